//! A solid cylinder with flat ends.

use serde::{Deserialize, Serialize};

use super::geometry::{
    Nearest, Probe, SignedDistance, across, between_faces, invalid_rod, length_and_direction, middle,
};
use crate::math::array::{dot, length, minus};

/// A solid cylinder with flat ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cylinder {
    /// Centre of one end (m).
    pub start: [f64; 3],
    /// Centre of the other end (m), apart from the first.
    pub end: [f64; 3],
    /// Radius (m), above 0.
    pub radius: f64,
}

impl SignedDistance for Cylinder {
    fn invalid(&self) -> Option<String> {
        invalid_rod(self.start, self.end, self.radius)
    }

    fn nearest(&self, probe: Probe) -> Nearest {
        let (p, along) = (probe.relative_to(self.start), minus(self.end, self.start));
        let (length, axis) = length_and_direction(along, along);
        let height = dot(p, axis);
        let flat = [0, 1, 2].map(|c| p[c] - height * axis[c]);
        let (r, radial) = length_and_direction(flat, across(axis));

        let middle = height - 0.5 * length;
        let end = axis.map(|c| c * middle.signum());
        // Two faces at right angles; the third is never the nearest.
        let beyond = [r - self.radius, middle.abs() - 0.5 * length, f64::NEG_INFINITY];
        between_faces(beyond, [radial, end, end])
    }

    fn reference(&self) -> [f64; 3] {
        middle(self.start, self.end)
    }

    fn thickness(&self) -> f64 {
        length(minus(self.end, self.start)).min(2.0 * self.radius)
    }

    fn reach(&self) -> f64 {
        length([0.5 * length(minus(self.end, self.start)), self.radius, 0.0])
    }
}

#[cfg(test)]
mod sample {
    use std::f64::consts::TAU;

    use super::{super::sample::*, *};
    use crate::math::array::cross;

    impl Sample for Cylinder {
        fn example() -> Self {
            let [start, end] = ends();
            Self { start, end, radius: 0.6 }
        }

        fn contains(&self, point: [f64; 3]) -> bool {
            let (way, from) = (minus(self.end, self.start), minus(point, self.start));
            let share = dot(from, way) / dot(way, way);
            (0.0..1.0).contains(&share) && length(cross(from, way)) / length(way) < self.radius
        }

        fn surface(&self) -> Vec<[f64; 3]> {
            let side = pairs(120, 300).map(|(s, t)| (1.6 * s - 0.7, self.radius, TAU * t));
            let ends = pairs(120, 300)
                .flat_map(|(s, t)| [0.9, -0.7].map(|height| (height, self.radius * s, TAU * t)));
            side.chain(ends).map(|(height, ring, angle)| turned_aside(height, ring, angle)).collect()
        }

        fn invalid_examples() -> Vec<(Self, &'static str)> {
            invalid_rods().map(|(start, end, radius)| (Self { start, end, radius }, "ends apart")).collect()
        }
    }
}
