//! A box, turned as one likes.

use serde::{Deserialize, Serialize};

use super::geometry::{
    Nearest, Probe, SignedDistance, between_faces, is_finite, is_length, is_square, is_unit,
};
use crate::math::array::{cross, dot, length};

/// A box that may be turned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cuboid {
    /// Centre (m).
    pub center: [f64; 3],
    /// Half of its extent along its own axes (m), above 0.
    pub half_extent: [f64; 3],
    /// Its own axes in the world: orthonormal, right-handed, one per row.
    pub axes: [[f64; 3]; 3],
}

impl SignedDistance for Cuboid {
    fn invalid(&self) -> Option<String> {
        let Self { center, half_extent, axes } = *self;
        if !is_finite(center) || !half_extent.into_iter().all(is_length) {
            return Some(format!(
                "centre {center:?}, half extent {half_extent:?}: a finite centre and half extents above 0 are needed"
            ));
        }
        (!is_right_handed(axes)).then(|| {
            format!("axes {axes:?}: three unit directions at right angles, right-handed, are needed")
        })
    }

    fn nearest(&self, probe: Probe) -> Nearest {
        let p = probe.relative_to(self.center);
        let own = self.axes.map(|axis| dot(p, axis));
        let beyond = [0, 1, 2].map(|k| own[k].abs() - self.half_extent[k]);
        let outward = |k: usize| self.axes[k].map(|c| c * own[k].signum());
        between_faces(beyond, [outward(0), outward(1), outward(2)])
    }

    fn reference(&self) -> [f64; 3] {
        self.center
    }

    fn thickness(&self) -> f64 {
        2.0 * self.half_extent.into_iter().fold(f64::INFINITY, f64::min)
    }

    fn reach(&self) -> f64 {
        length(self.half_extent)
    }
}

fn is_right_handed([x, y, z]: [[f64; 3]; 3]) -> bool {
    let unit = is_unit(x) && is_unit(y) && is_unit(z);
    unit && is_square(x, y) && is_square(y, z) && is_square(z, x) && dot(cross(x, y), z) > 0.0
}

#[cfg(test)]
mod sample {
    use super::{super::sample::*, *};
    use crate::math::array::minus;

    impl Sample for Cuboid {
        fn example() -> Self {
            Self { center: MIDDLE, half_extent: [0.9, 0.4, 0.6], axes: TURNED }
        }

        fn contains(&self, point: [f64; 3]) -> bool {
            (0..3).all(|k| dot(minus(point, self.center), self.axes[k]).abs() < self.half_extent[k])
        }

        fn surface(&self) -> Vec<[f64; 3]> {
            pairs(100, 100)
                .flat_map(|(s, t)| {
                    let (s, t) = (2.0 * s - 1.0, 2.0 * t - 1.0);
                    [[1.0, s, t], [-1.0, s, t], [s, 1.0, t], [s, -1.0, t], [s, t, 1.0], [s, t, -1.0]]
                })
                .map(|share| along(&[0, 1, 2].map(|k| (share[k] * self.half_extent[k], self.axes[k]))))
                .collect()
        }

        fn invalid_examples() -> Vec<(Self, &'static str)> {
            let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let of = |center: f64, half: f64, axes| Self {
                center: [center; 3],
                half_extent: [0.5, half, 0.5],
                axes,
            };
            vec![
                (of(f64::NAN, 1.0, [x, y, z]), "centre"),
                (of(0.0, 0.0, [x, y, z]), "half extent"),
                (of(0.0, f64::INFINITY, [x, y, z]), "half extent"),
                (of(0.0, 1.0, [x, y, [0.0, 0.0, -1.0]]), "right-handed"),
                (of(0.0, 1.0, [x, y, [0.0, 0.0, 1.0 + 2e-9]]), "axes"),
                (of(0.0, 1.0, [x, y, [0.0, 2e-9, 1.0]]), "axes"),
                (of(0.0, 1.0, [x, y, [f64::NAN; 3]]), "axes"),
            ]
        }
    }
}
