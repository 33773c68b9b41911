//! Quadratic bending of two triangles that share an edge: W = |K0 x0 + K1 x1 + K2 x2 + K3 x3|² / 2 (Bergou, Wardetzky,
//! Harmon, Zorin and Grinspun, "A Quadratic Bending Model for Inextensible Surfaces", 2006).
//!
//! x0 x1 is the edge, x2 and x3 lie across it. The numbers follow from the cotangents of the triangles at rest, times
//! sqrt(3 / (A0 + A1)), and add to 0; three are kept. The sum is the vector of mean curvature, 0 where the two triangles lie in a plane. The
//! energy is constant under isometries in its second derivative, which is that of every state: nothing is frozen.

use super::{
    element::{ElementLaw, Evaluated, Found, Treatment},
    threads::Threads,
};
use crate::{
    interrupt,
    math::{
        Pack,
        array::{cross, dot, length, minus},
        three,
    },
    mesh::{Pair, TriangleMesh},
};

/// Bending of two triangles that share an edge.
pub(crate) struct QuadraticBending;

impl ElementLaw<4, 3, 0> for QuadraticBending {
    fn elements(mesh: &TriangleMesh, _: &Threads) -> Found<4, 3> {
        let mut found = Found::default();
        for Pair { edge: [a, b], opposite: [c, d] } in mesh.pairs() {
            interrupt::point();
            let particles = [a, b, c, d];
            if let Some(rest) = rest(particles.map(|particle| mesh.points[particle as usize])) {
                found.add(particles, rest);
            }
        }
        found
    }

    #[inline(always)]
    fn evaluate<P: Pack>(rest: [P; 3], x: [[P; 3]; 4], _: Treatment<P>) -> Evaluated<P, 4, 0> {
        let bend = sum(rest, x);
        let wide = P::widen3(bend);
        let energy = P::Wide::of(0.5) * dot(wide, wide);
        Evaluated { energy, gradient: spread(rest, bend), frozen: [], stretch: P::zero() }
    }

    #[inline(always)]
    fn product<P: Pack>(rest: [P; 3], _: [P; 0], w: [[P; 3]; 4]) -> [[P; 3]; 4] {
        spread(rest, sum(rest, w))
    }

    #[inline(always)]
    fn diagonal<P: Pack>(rest: [P; 3], _: [P; 0]) -> [[P; 6]; 4] {
        let (zero, [a, b, c, d]) = (P::zero(), four(rest));
        let (a, b, c, d) = (a * a, b * b, c * c, d * d);
        [
            [a, a, a, zero, zero, zero],
            [b, b, b, zero, zero, zero],
            [c, c, c, zero, zero, zero],
            [d, d, d, zero, zero, zero],
        ]
    }

    fn shares(rest: [f64; 3]) -> [f64; 4] {
        // |sum of K_j w_j|² <= (sum of |K_j|) (sum of |K_j| |w_j|²).
        let first = -rest.iter().sum::<f64>();
        let magnitudes = [first, rest[0], rest[1], rest[2]].map(f64::abs);
        let total: f64 = magnitudes.iter().sum();
        magnitudes.map(|k| k * total)
    }
}

/// Numbers of an element from where its particles are at rest (m); none where it has no shape to resist with.
fn rest(x: [[f64; 3]; 4]) -> Option<[f64; 3]> {
    let [a, b, c, d] = x;
    let cotangent = |at: [f64; 3], to: [f64; 3], other: [f64; 3]| {
        let (u, v) = (minus(to, at), minus(other, at));
        dot(u, v) / length(cross(u, v))
    };
    let area = |apex: [f64; 3]| 0.5 * length(cross(minus(b, a), minus(apex, a)));
    let at_a = [cotangent(a, b, c), cotangent(a, b, d)];
    let at_b = [cotangent(b, a, c), cotangent(b, a, d)];

    let scale = (3.0 / (area(c) + area(d))).sqrt();
    let numbers = [at_a[0] + at_a[1], -at_a[0] - at_b[0], -at_a[1] - at_b[1]].map(|k| k * scale);
    numbers.iter().all(|k| k.is_finite()).then_some(numbers)
}

/// All four numbers: they add to 0, so that nothing depends on where the origin is.
#[inline(always)]
fn four<P: Pack>([b, c, d]: [P; 3]) -> [P; 4] {
    [P::zero() - (b + c + d), b, c, d]
}

/// The sum of K_j x_j, as K_j (x_j - x_0).
#[inline(always)]
fn sum<P: Pack>(rest: [P; 3], x: [[P; 3]; 4]) -> [P; 3] {
    three!(|c| rest[0] * (x[1][c] - x[0][c]) + rest[1] * (x[2][c] - x[0][c]) + rest[2] * (x[3][c] - x[0][c]))
}

/// The vector, multiplied by each K_j.
#[inline(always)]
fn spread<P: Pack>(rest: [P; 3], v: [P; 3]) -> [[P; 3]; 4] {
    let k = four(rest);
    [three!(|c| k[0] * v[c]), three!(|c| k[1] * v[c]), three!(|c| k[2] * v[c]), three!(|c| k[3] * v[c])]
}
