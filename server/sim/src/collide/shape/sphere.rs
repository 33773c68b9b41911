//! A ball: its centre and radius, and how far a point is from its surface.

use serde::{Deserialize, Serialize};

use super::geometry::{Nearest, Probe, SignedDistance, is_finite, is_length, length_and_direction};

/// All points within a radius.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sphere {
    /// Centre (m).
    pub center: [f64; 3],
    /// Radius (m), above 0.
    pub radius: f64,
}

impl SignedDistance for Sphere {
    fn invalid(&self) -> Option<String> {
        let Self { center, radius } = *self;
        (!is_finite(center) || !is_length(radius)).then(|| {
            format!("centre {center:?}, radius {radius}: a finite centre and a radius above 0 are needed")
        })
    }

    fn nearest(&self, probe: Probe) -> Nearest {
        let (length, normal) = length_and_direction(probe.relative_to(self.center), [0.0, 1.0, 0.0]);
        (length - self.radius, normal)
    }

    fn reference(&self) -> [f64; 3] {
        self.center
    }

    fn thickness(&self) -> f64 {
        2.0 * self.radius
    }

    fn reach(&self) -> f64 {
        self.radius
    }
}

#[cfg(test)]
mod sample {
    use std::f64::consts::TAU;

    use super::{super::sample::*, *};
    use crate::math::array::{length, minus};

    impl Sample for Sphere {
        fn example() -> Self {
            Self { center: MIDDLE, radius: 0.8 }
        }

        fn contains(&self, point: [f64; 3]) -> bool {
            length(minus(point, self.center)) < self.radius
        }

        #[allow(clippy::disallowed_methods, reason = "points of the tests, not of a step")]
        fn surface(&self) -> Vec<[f64; 3]> {
            let polar = |s: f64| (self.radius * (0.5 * TAU * s).cos(), self.radius * (0.5 * TAU * s).sin());
            pairs(200, 400).map(|(s, t)| turned(polar(s).0, polar(s).1, TAU * t)).collect()
        }

        fn invalid_examples() -> Vec<(Self, &'static str)> {
            let of = |c: f64, radius| Self { center: [c; 3], radius };
            vec![(of(f64::INFINITY, 1.0), "centre"), (of(0.0, 0.0), "radius"), (of(0.0, f64::NAN), "radius")]
        }
    }
}
