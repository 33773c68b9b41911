//! Bending of a plate: W = |s1|² + |s2|² + |s3|² over 2, the second derivatives of the quadratic through six points, times the
//! root of the area.
//!
//! An element is a triangle with the three points across its edges ("smoothed hinge", arXiv 2502.10872). At rest they are
//! laid into its plane; s_a is a sum of K_aj x_j that is 0 on every affine map of that. The numbers are those of the quadratic
//! with the least second derivatives, so that an edge without a neighbour is free of moments. All energy is divided by what a
//! mesh that may relax makes of it. The second derivative of W is that of every state: nothing is frozen.

mod six_points;
mod patch;
mod envelope;
mod factor;

use super::{
    element::{ElementLaw, Evaluated, Found, Treatment},
    threads::Threads,
};
use crate::{
    interrupt,
    math::{Pack, array::dot},
    mesh::TriangleMesh,
};

use factor::factor;
use six_points::{SixPoints, six_points};

/// Bending of a triangle with its neighbours.
pub(crate) struct Plate;

impl ElementLaw<6, 15, 0> for Plate {
    fn elements(mesh: &TriangleMesh, _: &Threads) -> Found<6, 15> {
        let around = mesh.surrounded();
        let mut bending = factor(&mesh.points, &around);
        let mut found = Found::default();
        for particles in around {
            interrupt::point();
            let x = particles.map(|particle| mesh.points[particle as usize]);
            let Some(mut made) = six_points(particles, x) else { continue };
            bending.dropped += made.dropped;
            let particles = made.each_once(particles);
            let numbers = rest(&made, bending.factor);
            if numbers.iter().all(|number| number.is_finite()) {
                found.add(particles, numbers);
            }
        }
        found.bending = Some(bending);
        found
    }

    #[inline(always)]
    fn evaluate<P: Pack>(rest: [P; 15], x: [[P; 3]; 6], _: Treatment<P>) -> Evaluated<P, 6, 0> {
        let sums = sums(rest, x);
        let [a, b, c] = [P::widen3(sums[0]), P::widen3(sums[1]), P::widen3(sums[2])];
        let energy = P::Wide::of(0.5) * (dot(a, a) + dot(b, b) + dot(c, c));
        Evaluated { energy, gradient: spread(rest, sums), frozen: [], stretch: P::zero() }
    }

    #[inline(always)]
    fn product<P: Pack>(rest: [P; 15], _: [P; 0], w: [[P; 3]; 6]) -> [[P; 3]; 6] {
        spread(rest, sums(rest, w))
    }

    #[inline(always)]
    fn diagonal<P: Pack>(rest: [P; 15], _: [P; 0]) -> [[P; 6]; 6] {
        let mut blocks = [[P::zero(); 6]; 6];
        for a in 0..3 {
            let mut first = P::zero();
            for j in 0..5 {
                let number = rest[5 * a + j];
                first += number;
                for c in 0..3 {
                    blocks[j + 1][c] += number * number;
                }
            }
            for c in 0..3 {
                blocks[0][c] += first * first;
            }
        }
        blocks
    }

    fn shares(rest: [f64; 15]) -> [f64; 6] {
        // |sum of K_j w_j|² <= (sum of |K_j|) (sum of |K_j| |w_j|²), for each of the three.
        let mut shares = [0.0; 6];
        for of_one in rest.as_chunks::<5>().0 {
            let [b, c, d, e, f] = *of_one;
            let magnitudes = [-(b + c + d + e + f), b, c, d, e, f].map(f64::abs);
            let total: f64 = magnitudes.iter().sum();
            for (share, magnitude) in shares.iter_mut().zip(magnitudes) {
                *share += magnitude * total;
            }
        }
        shares
    }
}

/// What an element keeps: the numbers of all particles but the first, for they add to 0, times the root of its area over the
/// factor.
fn rest(made: &SixPoints, factor: f64) -> [f64; 15] {
    let scale = (made.area / factor).sqrt();
    std::array::from_fn(|place| made.numbers[place / 5][place % 5 + 1] * scale)
}

/// The three sums of K_aj x_j, as K_aj (x_j - x_0).
#[inline(always)]
fn sums<P: Pack>(rest: [P; 15], x: [[P; 3]; 6]) -> [[P; 3]; 3] {
    let mut sums = [[P::zero(); 3]; 3];
    for j in 0..5 {
        for c in 0..3 {
            let away = x[j + 1][c] - x[0][c];
            for a in 0..3 {
                sums[a][c] += rest[5 * a + j] * away;
            }
        }
    }
    sums
}

/// At each particle the three vectors, multiplied by its K_aj and added.
#[inline(always)]
fn spread<P: Pack>(rest: [P; 15], v: [[P; 3]; 3]) -> [[P; 3]; 6] {
    let mut at = [[P::zero(); 3]; 6];
    for j in 0..5 {
        for c in 0..3 {
            let of_one = rest[j] * v[0][c] + rest[5 + j] * v[1][c] + rest[10 + j] * v[2][c];
            at[j + 1][c] = of_one;
            at[0][c] -= of_one;
        }
    }
    at
}
