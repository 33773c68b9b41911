//! Springs of a PLY: the element `edge`, where it has two points and a stiffness.

use nappe_sim::mesh::{MeshSpring, SpringKind, TriangleMesh, repeated_spring};

use super::{
    header::Element,
    payload::{Payload, Row, named},
    places::{EDGE, Place, REST_LENGTH, SPRING},
};
use crate::{
    error::{ErrorKind, SceneError},
    mesh::memory::make_room,
};

/// Whether elements are springs. Edges without a stiffness are lines that a program drew, and are skipped.
pub(super) fn are_springs(element: &Element<'_>) -> bool {
    element.name == EDGE && SPRING.into_iter().all(|place| element.has(place))
}

/// Reads all springs, whose points are there.
///
/// # Errors
/// A point that is not there or twice, a number that is none, two springs between two points.
pub(super) fn read_springs(
    payload: &mut Payload<'_>,
    element: &Element<'_>,
    mesh: &mut TriangleMesh,
) -> Result<(), SceneError> {
    let TriangleMesh { points, springs, .. } = mesh;
    make_room(springs, element.count as usize);
    let has_length = element.has(Place::Number(REST_LENGTH));
    let mut row = Row::default();
    for index in 0..element.count {
        payload.read(element, index, &mut row)?;
        let [first, second, stiffness, damping, length, kind, ..] = row.numbers;
        let who = || named(element, index);
        let end = |number: f64| {
            point(number, points.len()).ok_or_else(|| {
                let allowed = allowed(points.len());
                let message = format!("{} names point {number}; allowed: {allowed}", who());
                payload.error(ErrorKind::OutOfRange, message)
            })
        };
        let ends = [end(first)?, end(second)?];
        if ends[0] == ends[1] {
            let message = format!("{} joins point {} to itself; allowed: two points", who(), ends[0]);
            return Err(payload.error(ErrorKind::OutOfRange, message));
        }
        let kind = kind_of(kind).ok_or_else(|| {
            let message =
                format!("the 'kind' of {} is {kind}; allowed: 0 (stretch), 1 (shear), 2 (bend)", who());
            payload.error(ErrorKind::OutOfRange, message)
        })?;
        let rest_length = (has_length && !length.is_nan()).then_some(length);
        let spring = MeshSpring { points: ends, kind, stiffness, damping, rest_length };
        if let Some((what, value, allowed)) = spring.wrong_number() {
            let message = format!("the {what} of {} is {value}; allowed: {allowed}", who());
            return Err(payload.error(ErrorKind::OutOfRange, message));
        }
        springs.push(spring);
    }

    let Some([before, after]) = repeated_spring(springs) else { return Ok(()) };
    let [a, b] = springs[after].points;
    let message = format!(
        "edge {after} joins the points {a} and {b}, as edge {before} does; allowed: one spring between two points"
    );
    Err(payload.error_of_all(element, ErrorKind::Inconsistent, message))
}

/// The index of a point, below `count`; none: the number is no such index.
fn point(number: f64, count: usize) -> Option<u32> {
    ((0.0..count as f64).contains(&number) && number.fract() == 0.0).then_some(number as u32)
}

/// Which points a spring may join, of so many.
fn allowed(count: usize) -> String {
    match count.checked_sub(1) {
        None => "none, there are no points".to_owned(),
        Some(last) => format!("0 to {last}, the points of this mesh"),
    }
}

/// What a spring resists, by its number in the order of the kinds.
fn kind_of(number: f64) -> Option<SpringKind> {
    let mut numbered = (0_u32..).zip(SpringKind::ALL);
    numbered.find(|(own, _)| f64::from(*own) == number).map(|(_, kind)| kind)
}
