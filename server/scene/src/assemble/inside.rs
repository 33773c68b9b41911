//! Which particles are inside colliders at time 0, and how that is said.
//!
//! Reads places (m) of cloth or of snow and the colliders of the scene; gives numbers and parts of messages.

use nappe_sim::{
    collide::{Collider, StartInside},
    interrupt,
    math::array::{length, minus},
};

use crate::{error::SceneError, location::Location};

/// Depth (m) that is rounding, over 1 m and the largest coordinate.
const ROUNDING: f64 = 1e-9;

/// A collider, and where it stands in the scene.
pub(super) struct Solid<'a> {
    pub(super) collider: Collider,
    pub(super) at: Location<'a>,
}

impl Solid<'_> {
    /// How deep (m) a place is inside.
    pub(super) fn depth(&self, place: [f64; 3]) -> f64 {
        -self.collider.distance(place, 0.0).0
    }
}

/// Particles that are inside colliders: one at least.
pub(super) struct Inside<'s> {
    /// How many particles were looked at.
    pub(super) total: usize,
    /// How many of them are inside.
    pub(super) count: usize,
    /// How many colliders they are in.
    solids: usize,
    /// The particle that is deepest.
    particle: usize,
    /// How deep it is (m).
    depth: f64,
    /// The collider that it is in.
    pub(super) solid: &'s Solid<'s>,
}

impl<'s> Inside<'s> {
    /// Looks for particles with a mark that are deeper in a collider than is allowed at their place (m).
    pub(super) fn find(
        places: &[[f64; 3]],
        marked: &[bool],
        solids: &[&'s Solid<'s>],
        allowed: impl Fn([f64; 3]) -> f64,
    ) -> Option<Self> {
        if solids.is_empty() {
            return None;
        }
        let mut is_entered = vec![false; solids.len()];
        let mut count = 0;
        let mut deepest: Option<(usize, f64, &'s Solid<'s>)> = None;
        for (i, place) in places.iter().enumerate().filter(|(i, _)| marked[*i]) {
            interrupt::point();
            let mut is_inside = false;
            for (k, &solid) in solids.iter().enumerate() {
                let depth = solid.depth(*place);
                if depth > allowed(*place) {
                    is_inside = true;
                    is_entered[k] = true;
                    if deepest.is_none_or(|(_, most, _)| depth > most) {
                        deepest = Some((i, depth, solid));
                    }
                }
            }
            count += usize::from(is_inside);
        }

        let (particle, depth, solid) = deepest?;
        let entered = is_entered.iter().filter(|entered| **entered).count();
        Some(Self { total: places.len(), count, solids: entered, particle, depth, solid })
    }

    /// The word that goes with the number of particles: for several, or for one.
    pub(super) fn word<'w>(&self, several: &'w str, one: &'w str) -> &'w str {
        if self.count == 1 { one } else { several }
    }

    /// The collider by its name, or how many there are.
    pub(super) fn place(&self) -> String {
        match self.solids {
            1 => format!("collider '{}'", self.solid.collider.name),
            several => format!("{several} colliders"),
        }
    }

    /// How many particles begin where.
    pub(super) fn told(&self) -> String {
        let begin = self.word("begin", "begins");
        format!("{} of its {} particles {begin} inside {}", self.count, self.total, self.place())
    }

    /// Which particle is deepest, and how deep.
    pub(super) fn deepest(&self) -> String {
        let place = match self.solids {
            1 => String::new(),
            _ => format!(" in collider '{}'", self.solid.collider.name),
        };
        format!("particle {} deepest, by {} m{place}", self.particle, rounded(self.depth))
    }

    /// The error of a collider that refuses; `owner` says whose particles they are, and `by` how deep at least.
    pub(super) fn refused<T>(&self, owner: &str, by: &str, allowed: &str) -> Result<T, SceneError> {
        let begin = self.word("begin", "begins");
        self.solid.at.key("on_start_inside").inconsistent(format!(
            "is \"refuse\", and {} of the {} particles of {owner} {begin} inside {}{by}, {}; allowed: {allowed}",
            self.count,
            self.total,
            self.place(),
            self.deepest()
        ))
    }
}

/// The colliders of a kind that some of the places (m) may be inside of.
pub(super) fn near<'s>(
    places: &[[f64; 3]],
    solids: &'s [Solid<'s>],
    kind: StartInside,
) -> Vec<&'s Solid<'s>> {
    let (center, radius) = ball_about(places);
    let is_near =
        |collider: &Collider| collider.on_start_inside == kind && !collider.clears(center, radius, 0.0);
    solids.iter().filter(|solid| is_near(&solid.collider)).collect()
}

/// Centre and radius (m) of a ball that holds all places (m).
fn ball_about(places: &[[f64; 3]]) -> ([f64; 3], f64) {
    let ends = |choose: fn(f64, f64) -> f64, start: f64| {
        places.iter().fold([start; 3], |ends, place| [0, 1, 2].map(|c| choose(ends[c], place[c])))
    };
    let (low, high) = (ends(f64::min, f64::INFINITY), ends(f64::max, f64::NEG_INFINITY));
    ([0, 1, 2].map(|c| 0.5 * (low[c] + high[c])), 0.5 * length(minus(high, low)))
}

/// Depth (m) at a place (m) that is rounding.
pub(super) fn rounding(place: [f64; 3]) -> f64 {
    ROUNDING * (1.0 + place.iter().fold(0.0, |most: f64, c| most.max(c.abs())))
}

/// Three digits of a length (m) or a mass (kg), for people.
pub(super) fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}
