//! A plane, and everything behind it.

use serde::{Deserialize, Serialize};

use super::geometry::{Nearest, Probe, SignedDistance, is_finite, is_unit};
use crate::math::array::dot;

/// The half-space on the other side of `normal` from a plane through `point`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plane {
    /// A point of the plane (m).
    pub point: [f64; 3],
    /// Unit normal, towards the side where particles are.
    pub normal: [f64; 3],
}

impl SignedDistance for Plane {
    fn invalid(&self) -> Option<String> {
        let Self { point, normal } = *self;
        (!is_finite(point) || !is_unit(normal)).then(|| {
            format!("point {point:?}, normal {normal:?}: a finite point and a unit normal are needed")
        })
    }

    fn nearest(&self, probe: Probe) -> Nearest {
        (dot(probe.relative_to(self.point), self.normal), self.normal)
    }

    fn reference(&self) -> [f64; 3] {
        self.point
    }

    fn thickness(&self) -> f64 {
        f64::INFINITY
    }
}

#[cfg(test)]
mod sample {
    use super::{super::sample::*, *};
    use crate::math::array::minus;

    impl Sample for Plane {
        fn example() -> Self {
            Self { point: MIDDLE, normal: TURNED[0] }
        }

        fn contains(&self, point: [f64; 3]) -> bool {
            dot(minus(point, self.point), self.normal) < 0.0
        }

        fn surface(&self) -> Vec<[f64; 3]> {
            let [_, y, z] = TURNED;
            pairs(500, 500).map(|(s, t)| along(&[(10.0 * s - 5.0, y), (10.0 * t - 5.0, z)])).collect()
        }

        fn invalid_examples() -> Vec<(Self, &'static str)> {
            let [normal, ..] = TURNED;
            let at = |c: f64, normal| Self { point: [c; 3], normal };
            vec![(at(f64::NAN, normal), "point"), (at(0.0, [1.0, 1.0, 0.0]), "normal")]
        }
    }
}
