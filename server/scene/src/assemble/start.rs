//! Starts inside colliders: cloth and snow that begin there are told, refused, or taken out.
//!
//! Moves points of a mesh, of which springs are made afterwards, and leaves out particles of snow.

use nappe_sim::{
    cloth::OnPass,
    collide::StartInside,
    interrupt,
    math::array::{length, minus},
    snow::SnowObject,
};

use super::inside::{Inside, Solid, near, rounded, rounding};
use crate::error::SceneError;

/// Rounds over all colliders in which a particle must come out.
const ROUNDS: u32 = 16;

/// The cloth of a body before its springs are made.
pub(super) struct ClothStart<'a> {
    pub(super) name: &'a str,
    pub(super) on_pass: OnPass,
    /// Which particles no pin holds: the others pass through colliders.
    pub(super) free: &'a [bool],
}

impl ClothStart<'_> {
    /// Sees to particles that are inside a collider; the strings are warnings.
    pub(super) fn settle(
        &self,
        places: &mut [[f64; 3]],
        solids: &[Solid<'_>],
    ) -> Result<Vec<String>, SceneError> {
        let mut warnings = Vec::new();
        if let Some(inside) = self.find(places, solids, StartInside::Lift) {
            let (particle, way) = self.lift(places, solids)?;
            warnings.push(format!(
                "{} and {} lifted out before the first step, particle {particle} farthest, by {} m: springs are at rest as \
                 they lie now (on_start_inside = \"lift\")",
                inside.told(),
                inside.word("are", "is"),
                rounded(way)
            ));
        }

        if let Some(inside) = self.find(places, solids, StartInside::Refuse) {
            return inside.refused(
                &format!("body '{}'", self.name),
                "",
                "a body that begins outside, or \"lift\", which moves it out before the first step, or \"warn\"",
            );
        }

        let told = self.find(places, solids, StartInside::Warn);
        warnings.extend(told.map(|inside| self.warning(&inside)));
        Ok(warnings)
    }

    fn find<'s>(
        &self,
        places: &[[f64; 3]],
        solids: &'s [Solid<'s>],
        kind: StartInside,
    ) -> Option<Inside<'s>> {
        Inside::find(places, self.free, &near(places, solids, kind), rounding)
    }

    fn warning(&self, inside: &Inside<'_>) -> String {
        let not_passed = match self.on_pass {
            OnPass::Reject => " and does not count as passed for on_pass = \"reject\"",
            OnPass::Warn => "",
        };
        format!(
            "{}, {}: what is inside is pushed out at {} m/s (recovery){not_passed}; on_start_inside = \"lift\" moves it out \
             before the first step, \"refuse\" ends here",
            inside.told(),
            inside.deepest(),
            inside.solid.collider.recovery
        )
    }

    /// Moves free particles out of the colliders that lift; gives the one that goes farthest, and how far (m).
    fn lift(&self, places: &mut [[f64; 3]], solids: &[Solid<'_>]) -> Result<(usize, f64), SceneError> {
        let lifting: Vec<_> =
            solids.iter().filter(|solid| solid.collider.on_start_inside == StartInside::Lift).collect();
        let mut farthest = (0, 0.0);
        for (i, place) in places.iter_mut().enumerate().filter(|(i, _)| self.free[*i]) {
            interrupt::point();
            let before = *place;
            if let Err(solid) = come_out(place, &lifting) {
                return solid.at.key("on_start_inside").inconsistent(format!(
                    "is \"lift\", and particle {i} of body '{}' does not come out within {ROUNDS} rounds over all colliders: \
                     they overlap there, or meet in a narrow gap; allowed: a body that begins outside, or \"warn\"",
                    self.name
                ));
            }
            let way = length(minus(*place, before));
            if way > farthest.1 {
                farthest = (i, way);
            }
        }
        Ok(farthest)
    }
}

/// Moves a place (m) to the margin of each collider that it is inside of, until it is in none; else gives the collider
/// that moved it last.
fn come_out<'s>(place: &mut [f64; 3], solids: &[&'s Solid<'s>]) -> Result<(), &'s Solid<'s>> {
    let mut last = None;
    for _ in 0..=ROUNDS {
        last = None;
        for &solid in solids {
            let (distance, normal) = solid.collider.distance(*place, 0.0);
            if -distance > rounding(*place) {
                let way = solid.collider.margin - distance;
                *place = [0, 1, 2].map(|c| place[c] + way * normal[c]);
                last = Some(solid);
            }
        }
        if last.is_none() {
            break;
        }
    }
    last.map_or(Ok(()), Err)
}

/// Sees to the particles of an object of snow, on cells of side `cell` (m), that are inside a collider; the strings are
/// warnings.
pub(super) fn settle_snow(
    object: &mut SnowObject,
    cell: f64,
    solids: &[Solid<'_>],
) -> Result<Vec<String>, SceneError> {
    let mut warnings: Vec<String> = leave_out(object, solids)?.into_iter().collect();
    let all = vec![true; object.x.len()];
    let find = |kind| Inside::find(&object.x, &all, &near(&object.x, solids, kind), |_: [f64; 3]| cell);
    if let Some(inside) = find(StartInside::Refuse) {
        return inside.refused(
            &format!("snow '{}'", object.name),
            &format!(" by more than a cell ({cell} m)"),
            "snow that begins outside, or \"lift\", which leaves out what begins inside, or \"warn\"",
        );
    }

    warnings.extend(find(StartInside::Warn).map(|inside| {
        format!(
            "{} by more than a cell ({cell} m), {}: snow stays inside, since recovery is for cloth alone; on_start_inside = \
             \"lift\" leaves it out, \"refuse\" ends here",
            inside.told(),
            inside.deepest()
        )
    }));
    Ok(warnings)
}

/// Leaves out the particles that are inside a collider which lifts; the string says how many.
fn leave_out(object: &mut SnowObject, solids: &[Solid<'_>]) -> Result<Option<String>, SceneError> {
    let lifting = near(&object.x, solids, StartInside::Lift);
    let all = vec![true; object.x.len()];
    let Some(inside) = Inside::find(&object.x, &all, &lifting, rounding) else { return Ok(None) };
    if inside.count == inside.total {
        return inside.solid.at.key("on_start_inside").inconsistent(format!(
            "is \"lift\", and all {} particles of snow '{}' begin inside {}: none would be left; allowed: snow that begins \
             outside, or \"warn\"",
            inside.total,
            object.name,
            inside.place()
        ));
    }

    let is_outside = |place: &[f64; 3]| lifting.iter().all(|solid| solid.depth(*place) <= rounding(*place));
    let kept: Vec<bool> = object.x.iter().map(is_outside).collect();
    let before: f64 = object.mass.iter().sum();
    keep(&mut object.x, &kept);
    keep(&mut object.v, &kept);
    for numbers in [&mut object.mass, &mut object.volume, &mut object.stiffness] {
        keep(numbers, &kept);
    }
    let left: f64 = object.mass.iter().sum();
    Ok(Some(format!(
        "{} and {} left out before the first step, {} kg of {} kg (on_start_inside = \"lift\")",
        inside.told(),
        inside.word("are", "is"),
        rounded(before - left),
        rounded(before)
    )))
}

/// Keeps the values that have the mark; an empty list stays empty.
fn keep<T>(values: &mut Vec<T>, kept: &[bool]) {
    let mut kept = kept.iter();
    values.retain(|_| kept.next().is_some_and(|kept| *kept));
}
