//! A cylinder with round ends.

use serde::{Deserialize, Serialize};

use super::geometry::{Nearest, Probe, SignedDistance, across, invalid_rod, length_and_direction, middle};
use crate::math::array::{dot, length, minus};

/// All points within `radius` of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Capsule {
    /// One end of the segment (m).
    pub start: [f64; 3],
    /// The other end (m), apart from the first.
    pub end: [f64; 3],
    /// Radius (m), above 0.
    pub radius: f64,
}

impl SignedDistance for Capsule {
    fn invalid(&self) -> Option<String> {
        invalid_rod(self.start, self.end, self.radius)
    }

    fn nearest(&self, probe: Probe) -> Nearest {
        let (p, along) = (probe.relative_to(self.start), minus(self.end, self.start));
        let share = (dot(p, along) / dot(along, along)).clamp(0.0, 1.0);
        let from_axis = [0, 1, 2].map(|c| p[c] - share * along[c]);
        let (length, normal) = length_and_direction(from_axis, across(along));
        (length - self.radius, normal)
    }

    fn reference(&self) -> [f64; 3] {
        middle(self.start, self.end)
    }

    fn thickness(&self) -> f64 {
        2.0 * self.radius
    }

    fn reach(&self) -> f64 {
        0.5 * length(minus(self.end, self.start)) + self.radius
    }
}

#[cfg(test)]
mod sample {
    use std::f64::consts::TAU;

    use super::{super::sample::*, *};

    impl Sample for Capsule {
        fn example() -> Self {
            let [start, end] = ends();
            Self { start, end, radius: 0.5 }
        }

        fn contains(&self, point: [f64; 3]) -> bool {
            (0..=4000).any(|i| {
                let share = f64::from(i) / 4000.0;
                let axis = [0, 1, 2].map(|c| self.start[c] + share * (self.end[c] - self.start[c]));
                length(minus(point, axis)) < self.radius
            })
        }

        #[allow(clippy::disallowed_methods, reason = "points of the tests, not of a step")]
        fn surface(&self) -> Vec<[f64; 3]> {
            let side = pairs(120, 300).map(|(s, t)| (1.6 * s - 0.7, self.radius, TAU * t));
            let ends = pairs(120, 300).flat_map(|(s, t)| {
                let (bulge, ring) = (0.25 * TAU * s).sin_cos();
                let ends = [0.9 + self.radius * bulge, -0.7 - self.radius * bulge];
                ends.map(|height| (height, self.radius * ring, TAU * t))
            });
            side.chain(ends).map(|(height, ring, angle)| turned_aside(height, ring, angle)).collect()
        }

        fn invalid_examples() -> Vec<(Self, &'static str)> {
            invalid_rods().map(|(start, end, radius)| (Self { start, end, radius }, "ends apart")).collect()
        }
    }
}
