//! What shapes have in common: what each says of itself, and the geometry that several share.

use crate::math::array::{cross, dot, length, minus};

/// How far from 1 or 0 the products of unit directions at right angles may be.
const SQUARE: f64 = 1e-9;

/// Signed distance (m) from a surface, negative inside, and the unit outward normal there.
pub(super) type Nearest = (f64, [f64; 3]);

/// A point (m), and how far (m) the shape has moved since time 0.
#[derive(Clone, Copy)]
pub(super) struct Probe {
    pub(super) point: [f64; 3],
    pub(super) shift: [f64; 3],
}

impl Probe {
    /// The vector to the point from a place of the shape; `start` is where that was at time 0.
    pub(super) fn relative_to(&self, start: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|c| self.point[c] - start[c] - self.shift[c])
    }
}

/// What a shape says of itself; its numbers are binary64, whatever the precision of the state.
pub(super) trait SignedDistance {
    /// Says which numbers make no shape, if any do.
    fn invalid(&self) -> Option<String>;

    /// Distance and normal, exact inside and outside. Where several points of the surface are nearest
    /// the normal is that of one of them.
    fn nearest(&self, probe: Probe) -> Nearest;

    /// The point (m) at time 0 that its position is that of, and about which it turns.
    fn reference(&self) -> [f64; 3];

    /// Least way (m) through its middle, from one side to the other; infinite where there is no other side.
    fn thickness(&self) -> f64;

    /// How far (m) the farthest point of its surface is from its reference point; infinite where it has no end.
    fn reach(&self) -> f64 {
        f64::INFINITY
    }

    /// Whether a particle outside may touch it at several places that look different ways.
    fn has_creases(&self) -> bool {
        false
    }
}

/// Length and direction of a vector; `none` is the direction of one without length.
pub(super) fn length_and_direction(v: [f64; 3], none: [f64; 3]) -> Nearest {
    let length = length(v);
    (length, if length > 0.0 { v.map(|c| c / length) } else { none })
}

/// A unit direction at right angles to another.
pub(super) fn across(axis: [f64; 3]) -> [f64; 3] {
    let least = if axis[0].abs() <= axis[1].abs().min(axis[2].abs()) {
        [1.0, 0.0, 0.0]
    } else if axis[1].abs() <= axis[2].abs() {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    length_and_direction(cross(axis, least), least).1
}

/// Distance from a solid between faces at right angles, from that of each: beyond several, it is
/// that of their common edge or corner; beyond none, that of the nearest face.
pub(super) fn between_faces(beyond: [f64; 3], outward: [[f64; 3]; 3]) -> Nearest {
    let outside = beyond.map(|b| b.max(0.0));
    let length = length(outside);
    if length > 0.0 {
        let share = outside.map(|b| b / length);
        return (length, [0, 1, 2].map(|c| (0..3).map(|k| share[k] * outward[k][c]).sum()));
    }

    let nearest = (1..3).fold(0, |best, k| if beyond[k] > beyond[best] { k } else { best });
    (beyond[nearest], outward[nearest])
}

pub(super) fn is_finite(v: [f64; 3]) -> bool {
    v.iter().all(|c| c.is_finite())
}

/// Whether a number can be a length: finite and above 0.
pub(super) fn is_length(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

pub(super) fn is_unit(v: [f64; 3]) -> bool {
    (dot(v, v) - 1.0).abs() < SQUARE
}

/// Whether two directions are at right angles.
pub(super) fn is_square(a: [f64; 3], b: [f64; 3]) -> bool {
    dot(a, b).abs() < SQUARE
}

/// The middle of a segment.
pub(super) fn middle(start: [f64; 3], end: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| 0.5 * (start[c] + end[c]))
}

/// Says why two ends and a radius make no rod, if they do not.
pub(super) fn invalid_rod(start: [f64; 3], end: [f64; 3], radius: f64) -> Option<String> {
    let between = length(minus(end, start));
    // The second also refuses ends so close that the square of their distance is lost.
    let apart = is_length(between) && is_length(between * between);
    (!is_finite(start) || !is_finite(end) || !apart || !is_length(radius)).then(|| {
        format!(
            "start {start:?}, end {end:?}, radius {radius}: two finite ends apart from each other and a \
             radius above 0 are needed"
        )
    })
}
