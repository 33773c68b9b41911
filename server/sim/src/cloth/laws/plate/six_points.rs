//! Second derivatives of the quadratic through six points: the corners of a triangle and the points across its edges, laid into
//! its plane.
//!
//! Reads six points at rest (m); gives the numbers by which the second derivatives (1/m) follow from where they are.

use std::f64::consts::FRAC_1_SQRT_2;

use crate::math::array::{cross, dot, length, minus};

/// Least singular value of the fit that is kept, in largest ones.
const LEAST: f64 = 1.0 / 50.0;
/// Turns of all pairs of rows, at most; four of them reach binary64.
const TURNS: usize = 30;

/// How the second derivatives of six points follow from where they are.
pub(super) struct SixPoints {
    /// Of x² / 2, x y / sqrt 2 and y² / 2 the numbers K of the six particles (1/m²), whose sum is 0.
    pub(super) numbers: [[f64; 6]; 3],
    /// Area of the triangle (m²).
    pub(super) area: f64,
    /// Singular values that were too small.
    pub(super) dropped: usize,
}

impl SixPoints {
    /// Lets a particle that lies across two edges stand once: its numbers are added up, and in place of the other one the corner
    /// stands again, with numbers 0. Returns the particles.
    pub(super) fn each_once(&mut self, mut particles: [u32; 6]) -> [u32; 6] {
        for [one, other] in [[3, 4], [3, 5], [4, 5]] {
            if particles[one] == particles[other] {
                particles[other] = particles[other - 3];
                for numbers in &mut self.numbers {
                    numbers[one] += numbers[other];
                    numbers[other] = 0.0;
                }
            }
        }
        particles
    }
}

/// What one point across an edge says.
#[derive(Clone, Copy, Default)]
struct Row {
    /// How far each of the three quadratics is there from its interpolation between the corners (m²).
    quadratics: [f64; 3],
    /// By which multiples of where the particles are the same follows (1).
    particles: [f64; 6],
}

impl Row {
    fn norm(&self) -> f64 {
        length(self.quadratics)
    }

    /// a of this row and b of another.
    fn mix(&self, a: f64, other: &Self, b: f64) -> Self {
        Self {
            quadratics: std::array::from_fn(|c| a * self.quadratics[c] + b * other.quadratics[c]),
            particles: std::array::from_fn(|j| a * self.particles[j] + b * other.particles[j]),
        }
    }
}

/// The numbers of a triangle and of the points across its edges, which are at `x` (m); across an edge without one the corner
/// stands again. None where the triangle has no area, or no neighbours.
pub(super) fn six_points(particles: [u32; 6], x: [[f64; 3]; 6]) -> Option<SixPoints> {
    let ([a, b, c, ..], along) = (x, minus(x[1], x[0]));
    let normal = cross(along, minus(c, a));
    let (long, twice) = (length(along), length(normal));
    if twice <= 0.0 || !twice.is_finite() {
        return None;
    }
    let (first, second) = (along.map(|e| e / long), cross(normal, along).map(|e| e / (twice * long)));
    let middle: [f64; 3] = std::array::from_fn(|e| (a[e] + b[e] + c[e]) / 3.0);
    let corners = [a, b, c].map(|corner| {
        let from = minus(corner, middle);
        [dot(from, first), dot(from, second)]
    });

    let mut rows = [Row::default(); 3];
    for k in 0..3 {
        if particles[3 + k] != particles[k] {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let laid = across([corners[i], corners[j]], [x[i], x[j], x[3 + k]]);
            rows[k] = row(k, laid, &corners, twice);
        }
    }
    let count = rows.iter().filter(|row| row.norm() > 0.0).count();
    turn(&mut rows);
    let largest = rows.iter().map(Row::norm).fold(0.0, f64::max);
    let kept = rows.iter().filter(|row| row.norm() > 0.0 && row.norm() >= LEAST * largest);
    let (mut numbers, mut dropped) = ([[0.0; 6]; 3], count);
    for row in kept {
        dropped -= 1;
        let square = dot(row.quadratics, row.quadratics);
        for (numbers, quadratic) in numbers.iter_mut().zip(row.quadratics) {
            for (number, of_particle) in numbers.iter_mut().zip(row.particles) {
                *number += quadratic / square * of_particle;
            }
        }
    }
    (count > 0).then_some(SixPoints { numbers, area: 0.5 * twice, dropped })
}

/// Where a point (m) comes to lie beyond an edge of the triangle, whose ends lie at `laid` in its plane, the inside on their left.
fn across([from, to]: [[f64; 2]; 2], [start, end, point]: [[f64; 3]; 3]) -> [f64; 2] {
    let (edge, away) = (minus(end, start), minus(point, start));
    let square = dot(edge, edge);
    let (share, height) = (dot(away, edge) / square, length(cross(away, edge)) / square);
    let [u, v] = [to[0] - from[0], to[1] - from[1]];
    [from[0] + share * u + height * v, from[1] + share * v - height * u]
}

/// What a point across the edge opposite to corner `k` says, of a triangle of twice the area (m²).
fn row(k: usize, point: [f64; 2], corners: &[[f64; 2]; 3], twice: f64) -> Row {
    let mut row = Row { quadratics: quadratics(point), particles: [0.0; 6] };
    row.particles[3 + k] = 1.0;
    for corner in 0..3 {
        let [p, q] = [(corner + 1) % 3, (corner + 2) % 3].map(|other| corners[other]);
        let (u, v) = ([p[0] - point[0], p[1] - point[1]], [q[0] - point[0], q[1] - point[1]]);
        let share = (u[0] * v[1] - u[1] * v[0]) / twice;
        row.particles[corner] = -share;
        let there = quadratics(corners[corner]);
        for (quadratic, there) in row.quadratics.iter_mut().zip(there) {
            *quadratic -= share * there;
        }
    }
    row
}

/// x² / 2, x y / sqrt 2 and y² / 2: the sum of the squares of their multiples does not change as the axes turn.
fn quadratics([x, y]: [f64; 2]) -> [f64; 3] {
    [0.5 * x * x, FRAC_1_SQRT_2 * x * y, 0.5 * y * y]
}

/// Turns pairs of rows until all are orthogonal (Hestenes 1958): their norms are then the singular values.
fn turn(rows: &mut [Row; 3]) {
    for _ in 0..TURNS {
        let mut is_done = true;
        for [i, j] in [[0, 1], [0, 2], [1, 2]] {
            let (one, other) = (rows[i], rows[j]);
            let [a, b, both] = [(one, one), (other, other), (one, other)]
                .map(|(one, other)| dot(one.quadratics, other.quadratics));
            if both.abs() <= 1e-15 * (a * b).sqrt() {
                continue;
            }
            is_done = false;
            let half = 0.5 * (b - a) / both;
            let tangent = half.signum() / (half.abs() + (1.0 + half * half).sqrt());
            let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
            rows[i] = one.mix(cosine, &other, -cosine * tangent);
            rows[j] = one.mix(cosine * tangent, &other, cosine);
        }
        if is_done {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;

    /// Places in a plane that is turned in space, of six points of a patch moved by noise.
    fn points(seed: u32) -> ([[f64; 2]; 6], [[f64; 3]; 6]) {
        const BASE: [[f64; 2]; 6] =
            [[0.0, 0.0], [1.0, 0.0], [0.4, 0.9], [1.3, 0.9], [-0.5, 0.8], [0.5, -0.8]];
        let mut state = seed;
        let mut noise = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1_u32 << 23) - 1.0
        };
        let flat = BASE.map(|place| place.map(|c| c + 0.15 * noise()));
        let ([e, f], from) = ([[0.6, 0.8, 0.0], [-0.48, 0.36, 0.8]], [3.0, -1.0, 2.0]);
        (flat, flat.map(|[x, y]| std::array::from_fn(|c| from[c] + x * e[c] + y * f[c])))
    }

    fn sums(made: &SixPoints, values: [f64; 6]) -> [f64; 3] {
        made.numbers.map(|numbers| numbers.iter().zip(values).map(|(number, value)| number * value).sum())
    }

    fn square(made: &SixPoints, values: [f64; 6]) -> f64 {
        let sums = sums(made, values);
        dot(sums, sums)
    }

    const ALL: [u32; 6] = [0, 1, 2, 3, 4, 5];
    const PLANES: [fn([f64; 2]) -> f64; 3] = [|_| 1.0, |[x, _]| x, |[_, y]| y];

    #[test]
    fn second_derivatives_of_quadratics_are_exact_and_those_of_planes_are_0() {
        for seed in 0..50 {
            let (flat, x) = points(seed);
            let made = six_points(ALL, x).expect("a triangle with neighbours");
            assert_eq!(made.dropped, 0);
            let [p, q] = [minus(x[1], x[0]), minus(x[2], x[0])];
            assert!((made.area - 0.5 * length(cross(p, q))).abs() < 1e-14);
            for value in PLANES {
                assert!(square(&made, flat.map(value)) < 1e-24, "seed {seed}");
            }
            // |second derivatives|² of a x² / 2 + b x y + c y² / 2, in any axes.
            let (a, b, c) = (0.7, -1.3, 0.4);
            let found = square(&made, flat.map(|[x, y]| 0.5 * a * x * x + b * x * y + 0.5 * c * y * y));
            let expected = a * a + 2.0 * b * b + c * c;
            assert!((found / expected - 1.0).abs() < 1e-12, "seed {seed}: {found}, {expected}");
        }
    }

    #[test]
    fn a_missing_neighbour_counts_for_nothing_and_leaves_the_least_second_derivatives() {
        let (flat, x) = points(7);
        let whole = six_points(ALL, x).expect("a triangle with neighbours");
        let values = flat.map(|[x, y]| 0.5 * x * x + 0.2 * x * y - 0.3 * y * y);
        let mut most = square(&whole, values);
        for (missing, count) in [([0, 1, 2, 3, 4, 2], 2), ([0, 1, 2, 0, 4, 2], 1)] {
            let made = six_points(missing, x).expect("a triangle with neighbours");
            for numbers in made.numbers {
                assert_eq!(numbers[5], 0.0);
            }
            // What is left out can only make it less, and the points that are there are still met.
            let least = square(&made, values);
            assert!(least <= most * (1.0 + 1e-12), "{count}: {least}, {most}");
            assert!(least > 0.0);
            most = least;
        }
        assert!(six_points([0, 1, 2, 0, 1, 2], x).is_none());
    }

    #[test]
    fn neighbours_are_unfolded() {
        // Each is turned about its edge: the element does not know.
        let (_, x) = points(3);
        let flat = six_points(ALL, x).expect("a triangle with neighbours");
        let mut folded = x;
        for k in 0..3 {
            let [start, end, point]: [Vec3<f64>; 3] =
                [x[(k + 1) % 3], x[(k + 2) % 3], x[3 + k]].map(Vec3::from);
            let axis = nalgebra::Unit::new_normalize(end - start);
            let turn = nalgebra::Rotation3::from_axis_angle(&axis, 0.4 + 0.7 * k as f64);
            folded[3 + k] = (start + turn * (point - start)).into();
        }
        let folded = six_points(ALL, folded).expect("a triangle with neighbours");
        for (one, other) in flat.numbers.as_flattened().iter().zip(folded.numbers.as_flattened()) {
            assert!((one - other).abs() < 1e-12 * (1.0 + one.abs()), "{one}, {other}");
        }
    }

    #[test]
    fn a_point_across_two_edges_stands_once() {
        let (_, x) = points(11);
        let mut made = six_points(ALL, x).expect("a triangle with neighbours");
        let before = made.numbers;
        assert_eq!(made.each_once([0, 1, 2, 7, 8, 7]), [0, 1, 2, 7, 8, 2]);
        for (numbers, before) in made.numbers.iter().zip(before) {
            assert_eq!(*numbers, [before[0], before[1], before[2], before[3] + before[5], before[4], 0.0]);
        }
    }

    #[test]
    fn what_six_points_hardly_tell_is_dropped_and_near_degenerate_triangles_stay_finite() {
        // All points across lie on one line with two corners, but for rounding: nothing tells how it bends across.
        let on_a_line = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.5, 1e-6, 0.0],
            [2.0, 1e-6, 0.0],
            [-1.0, 1e-6, 0.0],
            [0.5, -1e-6, 0.0],
        ];
        let made = six_points(ALL, on_a_line).expect("a thin triangle");
        assert!(made.dropped > 0);
        assert!(made.numbers.as_flattened().iter().all(|number| number.is_finite()));
        assert!(six_points(ALL, [[0.5, 0.25, 1.0]; 6]).is_none());
    }
}
