//! The ground below a trough: its surface is half a tube and a flat on either side.

use serde::{Deserialize, Serialize};

use super::geometry::{Nearest, Probe, SignedDistance, is_finite, is_length, is_square, is_unit};
use crate::math::array::{cross, dot};

/// The ground below a trough: outside of a tube, below its axis; endless along the axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HalfPipe {
    /// A point of the axis (m).
    pub point: [f64; 3],
    /// Unit direction of the axis.
    pub axis: [f64; 3],
    /// Unit direction of the opening, at right angles to the axis.
    pub up: [f64; 3],
    /// Inner radius (m), above 0.
    pub radius: f64,
}

impl SignedDistance for HalfPipe {
    fn invalid(&self) -> Option<String> {
        let Self { point, axis, up, radius } = *self;
        if !is_finite(point) || !is_length(radius) {
            return Some(format!(
                "point {point:?}, radius {radius}: a finite point and a radius above 0 are needed"
            ));
        }
        let square = is_unit(axis) && is_unit(up) && is_square(axis, up);
        (!square).then(|| format!("axis {axis:?}, up {up:?}: two unit directions at right angles are needed"))
    }

    fn nearest(&self, probe: Probe) -> Nearest {
        let (up, radius) = (self.up, self.radius);
        let p = probe.relative_to(self.point);
        let lateral = cross(up, self.axis);
        let (side, height) = (dot(p, lateral), dot(p, up));
        let across = side.abs();
        let toward = |a: f64, b: f64| [0, 1, 2].map(|c| a * side.signum() * lateral[c] + b * up[c]);

        // Above a bank.
        if across >= radius && height >= 0.0 {
            return (height, up);
        }

        // Between the rims and above the axis: the nearer rim is the nearest point.
        if height > 0.0 {
            let gap = across - radius;
            let length = (gap * gap + height * height).sqrt();
            return (length, if length > 0.0 { toward(gap / length, height / length) } else { up });
        }

        // Within the trough or in the ground: the bank or the wall.
        let r = (across * across + height * height).sqrt();
        let wall = radius - r;
        if across >= radius && height > wall {
            return (height, up);
        }
        (wall, if r > 0.0 { toward(-across / r, -height / r) } else { up })
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
    use std::f64::consts::TAU;

    use super::{super::sample::*, *};
    use crate::math::array::{length, minus};

    impl Sample for HalfPipe {
        fn example() -> Self {
            let [_, y, z] = TURNED;
            Self { point: MIDDLE, axis: z, up: y, radius: 0.9 }
        }

        fn contains(&self, point: [f64; 3]) -> bool {
            let from = minus(point, self.point);
            length(cross(from, self.axis)) > self.radius && dot(from, self.up) < 0.0
        }

        #[allow(clippy::disallowed_methods, reason = "points of the tests, not of a step")]
        fn surface(&self) -> Vec<[f64; 3]> {
            let ([x, y, z], radius) = (TURNED, self.radius);
            pairs(200, 500)
                .flat_map(|(s, t)| {
                    let (out, down) = ((0.5 * TAU * s).cos() * radius, -(0.5 * TAU * s).sin() * radius);
                    let flat = radius + 4.0 * s;
                    [(out, down), (flat, 0.0), (-flat, 0.0)]
                        .map(|(side, up)| along(&[(side, x), (up, y), (10.0 * t - 5.0, z)]))
                })
                .collect()
        }

        fn invalid_examples() -> Vec<(Self, &'static str)> {
            let [y, z] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let of = |point: f64, axis, up, radius| Self { point: [point; 3], axis, up, radius };
            vec![
                (of(f64::INFINITY, z, y, 1.0), "point"),
                (of(0.0, z, y, 0.0), "radius"),
                (of(0.0, z, y, f64::NAN), "radius"),
                (of(0.0, z, [0.0, 1.0, 2e-9], 1.0), "up"),
                (of(0.0, z, z, 1.0), "up"),
                (of(0.0, [0.0; 3], y, 1.0), "axis"),
            ]
        }
    }

    #[test]
    fn a_half_pipe_is_continuous_over_its_rims_and_its_axis_plane() {
        let [x, y, z] = TURNED;
        let at = |point| HalfPipe::example().nearest(Probe { point, shift: [0.0; 3] }).0;
        for side in [-2.0, -0.9, -0.5, 0.0, 0.3, 0.9, 1.7] {
            let near = |height: f64| at(along(&[(side, x), (height, y), (0.4, z)]));
            let [below, on, above] = [near(-1e-9), near(0.0), near(1e-9)];
            assert!(
                (above - on).abs() < 1.1e-9 && (on - below).abs() < 1.1e-9,
                "{side}: {below} {on} {above}"
            );
        }

        // At the rim the flat and the wall meet.
        let rim = at(along(&[(0.9, x)]));
        assert!(rim.abs() < 1e-15, "{rim}");
    }
}
