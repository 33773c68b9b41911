//! Balls that hold nothing of a surface: particles within one need not ask how far a mesh is.
//!
//! Reads places (m) as a collider sees them, and their distances (m) from it; writes distances that are certainly not less. A ball
//! holds for its collider, whatever happens to the particle: it decides whether to ask, and nothing else.

use crate::math::array::{length, minus};

/// Share of a radius that is given up for rounding to binary32.
const ROUNDING: f64 = 1e-6;

/// Bytes that a particle of cloth keeps of each mesh among the colliders.
pub const CLEAR_BYTES: u64 = size_of::<Clear>() as u64;

/// A ball about a place outside of a collider, as the collider sees it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Clear {
    /// Its centre and its radius (m); 0: nothing is known.
    at: [f32; 3],
    radius: f32,
}

impl Clear {
    /// The ball that a distance (m) clears about a place (m).
    pub(super) fn of(place: [f64; 3], distance: f64) -> Self {
        let at = place.map(|c| c as f32);
        let radius = (distance - length(minus(place, at.map(f64::from)))) * (1.0 - ROUNDING);
        Self { at, radius: radius.max(0.0) as f32 }
    }

    /// A distance (m) that a place (m) certainly has, below 0 where nothing is known.
    pub(super) fn at_least(&self, place: [f64; 3]) -> f64 {
        f64::from(self.radius) - length(minus(place, self.at.map(f64::from)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_place_is_said_to_be_farther_than_it_is() {
        // A wall at x = 0, seen from places along and across.
        for i in 1..2_000 {
            let place = [f64::from(i) * 1.37e-3, f64::from(i % 7) * 1e3, -0.1];
            let clear = Clear::of(place, place[0]);
            for away in [[0.0; 3], [-1e-3, 0.0, 0.0], [1e-4, 2e-4, -1e-4], [0.3, 0.0, 0.1]] {
                let other = [0, 1, 2].map(|c| place[c] + away[c]);
                let least = clear.at_least(other);
                assert!(least <= other[0], "{place:?} and {other:?}: {least}");
            }
            let least = clear.at_least(place);
            assert!(least > place[0] - 1e-6 * place[0] - 1e-3, "{place:?}: {least} of {}", place[0]);
        }
        assert!(Clear::default().at_least([0.1, 0.0, 0.0]) < 0.0, "nothing is known");
        assert!(Clear::of([1e-9; 3], 1e-20).at_least([1e-9; 3]) <= 1e-20);
    }

    #[test]
    fn what_has_no_distance_clears_nothing() {
        for bad in [f64::NAN, f64::NEG_INFINITY, -1.0] {
            assert!(Clear::of([0.0; 3], bad).at_least([1e-3; 3]) < 0.0, "{bad}");
        }
        assert!(!(Clear::of([0.0; 3], 1.0).at_least([f64::NAN; 3]) >= 0.0));
    }
}
