//! Objects of snow that share space with earlier ones, or whose own parts share some: told with volume and mass, or counted once.

use std::sync::Arc;

use nappe_sim::{interrupt, mesh::TriangleMesh, snow::SnowObject};

use super::object::{Plan, solid};
use crate::{
    error::SceneError,
    fill::{SharedByParts, TOLD, shared_box, shared_volume},
    location::Location,
    snow::{Overlap, SnowBody},
};

/// Points that are looked at for each particle of an object, in the boxes that it shares with earlier objects together.
const POINTS_PER_PARTICLE: u64 = 8;
/// Points that are looked at in each of these boxes, at least and at most.
const POINTS: [u64; 2] = [1 << 12, 1 << 15];

/// An object that was built. Its solid is made anew where another object is near: two are there at once, at most.
struct Earlier<'a> {
    text: &'a SnowBody,
    at: Location<'a>,
    mesh: Option<Arc<TriangleMesh>>,
    /// Lower and upper corner of the box around it (m).
    bounds: [[f64; 3]; 2],
}

/// Objects that were built, in their order.
#[derive(Default)]
pub(super) struct EarlierObjects<'a>(Vec<Earlier<'a>>);

impl<'a> EarlierObjects<'a> {
    /// Keeps what is needed of an object to compare later ones with it.
    pub(super) fn add(&mut self, plan: &Plan<'a>, at: &Location<'a>, mesh: Option<Arc<TriangleMesh>>) {
        let bounds = plan.solid().world_bounds();
        self.0.push(Earlier { text: plan.text(), at: at.clone(), mesh, bounds });
    }

    /// Compares an object with those before it: tells what they share, or takes its particles out of there.
    pub(super) fn compare(
        &self,
        plan: &Plan<'_>,
        object: &mut SnowObject,
        at: &Location<'_>,
    ) -> Result<Option<String>, SceneError> {
        let own = plan.solid();
        let bounds = own.world_bounds();
        let near = self.0.iter().filter_map(|other| Some((other, shared_box(bounds, other.bounds)?)));
        let near: Vec<_> = near.collect();
        if near.is_empty() {
            return Ok(None);
        }
        if plan.text().overlap == Overlap::Drop {
            return take_out(&near, object, at);
        }

        let [fewest, most] = POINTS;
        let points = POINTS_PER_PARTICLE * object.x.len() as u64 / near.len() as u64;
        let (mut count, mut sum, mut largest) = (0, 0.0, (0.0, ""));
        for (other, bounds) in near {
            let solid = solid(other.text, &other.at, other.mesh.as_deref())?;
            let volume = shared_volume([own, &solid], bounds, points.clamp(fewest, most));
            if volume > TOLD * own.volume().min(solid.volume()) {
                count += 1;
                sum += volume;
                if volume > largest.0 {
                    largest = (volume, other.text.name.as_str());
                }
            }
        }

        let density = object.mass.iter().sum::<f64>() / own.volume();
        let (volume, mass, name) = (in_digits(sum), in_digits(density * sum), largest.1);
        let whom = match count {
            0 => return Ok(None),
            1 => format!("'{name}'"),
            _ => format!("{count} earlier objects, '{name}' most,"),
        };
        Ok(Some(format!(
            "overlaps {whom} by {volume} m^3: {mass} kg are there twice; move it, or leave out its particles there by \
             overlap = \"drop\""
        )))
    }
}

/// Leaves out the particles that lie in earlier objects.
fn take_out(
    near: &[(&Earlier<'_>, [[f64; 3]; 2])],
    object: &mut SnowObject,
    at: &Location<'_>,
) -> Result<Option<String>, SceneError> {
    let count = object.x.len();
    let mut is_kept = vec![true; count];
    for (other, _) in near {
        let solid = solid(other.text, &other.at, other.mesh.as_deref())?;
        for (kept, x) in is_kept.iter_mut().zip(&object.x) {
            interrupt::point();
            *kept = *kept && !solid.holds(*x);
        }
    }

    retain(&mut object.x, &is_kept);
    retain(&mut object.v, &is_kept);
    retain(&mut object.mass, &is_kept);
    retain(&mut object.volume, &is_kept);
    retain(&mut object.stiffness, &is_kept);
    if object.x.is_empty() {
        let message =
            "is \"drop\", and all particles lie in earlier objects: nothing is left; allowed here: keep";
        return at.key("overlap").inconsistent(message);
    }
    let dropped = count - object.x.len();
    Ok((dropped > 0).then(|| {
        format!("overlap = \"drop\" leaves out {dropped} of {count} particles, which lie in earlier objects")
    }))
}

fn retain<T>(values: &mut Vec<T>, is_kept: &[bool]) {
    let mut kept = is_kept.iter().copied();
    values.retain(|_| kept.next().unwrap_or(false));
}

/// What parts of an object's mesh share, in words; `density` (kg/m³) is the object's.
pub(super) fn parts_in_words(shared: &SharedByParts, overlap: Overlap, density: f64) -> Vec<String> {
    let (volume, mass) = (in_digits(shared.volume), in_digits(density * shared.volume));
    let [a, b] = shared.most;
    let whose = match shared.pairs {
        1 => format!("the parts of its mesh that begin with triangles {a} and {b} overlap"),
        pairs => {
            format!(
                "{pairs} pairs of parts of its mesh overlap, most those that begin with triangles {a} and {b},"
            )
        }
    };

    let mut told = Vec::new();
    if shared.is_cut_off {
        told.push(
            "its mesh has too many parts near each other to see whether all of them overlap".to_owned(),
        );
    }
    match overlap {
        _ if shared.pairs == 0 => {}
        Overlap::Keep => told.push(format!(
            "{whose} by {volume} m^3: {mass} kg count twice; join them, or count them once by overlap = \"drop\""
        )),
        Overlap::Drop => told.push(format!("{whose} by {volume} m^3, which counts once")),
    }
    told
}

/// A measured number with three digits, which is about what it is worth.
fn in_digits(value: f64) -> String {
    let rounded = format!("{value:.2e}");
    rounded.parse::<f64>().map_or(rounded, |value| value.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measured_numbers_have_three_digits() {
        let cases = [
            (0.280_000_01, "0.28"),
            (112.04, "112"),
            (1234.0, "1230"),
            (0.000_123_456, "0.000123"),
            (0.0, "0"),
        ];
        for (value, text) in cases {
            assert_eq!(in_digits(value), text);
        }
    }
}
