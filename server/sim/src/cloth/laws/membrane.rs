//! The membrane of a fabric: W = A/2 (a (|w_u| - 1)² + b (|w_v| - 1)² + c (w_u . w_v)²) of a triangle of area A, with the
//! vectors w_u and w_v that a unit along the warp and along the weft became (Baraff and Witkin, "Large Steps in Cloth
//! Simulation", 1998).
//!
//! a, b and c are the shares of the stiffness along warp and weft and against shear. w_u is a sum of a_j x_j, and w_v one of
//! b_j x_j, with numbers that never change. What does not depend on loads is k u uᵀ of a thread in the direction u, and k g gᵀ of
//! shear, g_j = a_j w_v + b_j w_u: these damp too. Loads add k (1 - 1/|w|) (I - u uᵀ) and k (w_u . w_v) (dw_u . dw_v).

use super::{
    element::{Beyond, ElementLaw, Evaluated, Found, Treatment},
    spring::most_compressed,
    threads::{Directions, Threads, directions},
};
use crate::{
    interrupt,
    math::{
        Pack, Real,
        array::{cross, dot, length, minus},
        three,
    },
    mesh::TriangleMesh,
};

/// Rows and columns of xy, xz and yz.
const OFF_DIAGONAL: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

/// Stretch and shear of a triangle.
pub(crate) struct Membrane;

impl ElementLaw<3, 7, 12> for Membrane {
    fn elements(mesh: &TriangleMesh, threads: &Threads) -> Found<3, 7> {
        let mut found = Found::default();
        let triangles = mesh.each_once();
        let Directions { of_triangles, .. } = directions(mesh, &triangles, threads.warp);
        for (particles, warp) in triangles.into_iter().zip(of_triangles) {
            interrupt::point();
            let Some(warp) = warp else { continue };
            let x = particles.map(|particle| mesh.points[particle as usize]);
            if let Some(rest) = rest(x, warp, threads.shares) {
                found.add(particles, rest);
            }
        }
        found
    }

    #[inline(always)]
    fn evaluate<P: Pack>(rest: [P; 7], x: [[P; 3]; 3], treatment: Treatment<P>) -> Evaluated<P, 3, 12> {
        let [u, v] = stretched(rest, x);
        let (warp, weft, shear) = (Thread::new(u), Thread::new(v), dot(u, v));
        let (pull_u, pull_v, turn) =
            (rest[4] * warp.strain * warp.inverse, rest[5] * weft.strain * weft.inverse, rest[6] * shear);
        let of_u = three!(|c| pull_u * u[c] + turn * v[c]);
        let of_v = three!(|c| pull_v * v[c] + turn * u[c]);

        let [along_u, across_u] = warp.tangent(treatment);
        let [along_v, across_v] = weft.tangent(treatment);
        // Of dw_u . dw_v the part in the sum of both, or in their difference, is negative.
        let (half, back) = (P::of(0.5) * treatment.elastic, (-treatment.mirror).max(-P::one()));
        let (same, other) = (half * shear.abs() * (P::one() + back), half * shear * (P::one() - back));
        Evaluated {
            energy: energy(rest, x),
            gradient: spread(rest, [of_u, of_v]),
            frozen: [u[0], u[1], u[2], v[0], v[1], v[2], along_u, across_u, along_v, across_v, same, other],
            stretch: warp.length.max(weft.length),
        }
    }

    #[inline(always)]
    fn product<P: Pack>(rest: [P; 7], frozen: [P; 12], w: [[P; 3]; 3]) -> [[P; 3]; 3] {
        let [u0, u1, u2, v0, v1, v2, along_u, across_u, along_v, across_v, same, other] = frozen;
        let ([u, v], [du, dv]) = ([[u0, u1, u2], [v0, v1, v2]], stretched(rest, w));
        let (of_u, of_v) = (along_u * dot(u, du), along_v * dot(v, dv));
        let turn = dot(v, du) + dot(u, dv);
        spread(
            rest,
            [
                three!(|c| rest[4] * (of_u * u[c] + across_u * du[c])
                    + rest[6] * (turn * v[c] + same * du[c] + other * dv[c])),
                three!(|c| rest[5] * (of_v * v[c] + across_v * dv[c])
                    + rest[6] * (turn * u[c] + same * dv[c] + other * du[c])),
            ],
        )
    }

    #[inline(always)]
    fn diagonal<P: Pack>(rest: [P; 7], frozen: [P; 12]) -> [[P; 6]; 3] {
        let [u0, u1, u2, v0, v1, v2, along_u, across_u, along_v, across_v, same, other] = frozen;
        let ([u, v], (a, b)) = ([[u0, u1, u2], [v0, v1, v2]], three_of(rest));
        let mut blocks = [[P::zero(); 6]; 3];
        for j in 0..3 {
            let (of_u, of_v) = (rest[4] * a[j] * a[j], rest[5] * b[j] * b[j]);
            let g = three!(|c| a[j] * v[c] + b[j] * u[c]);
            let loads = same * (a[j] * a[j] + b[j] * b[j]) + P::of(2.0) * other * a[j] * b[j];
            let across = of_u * across_u + of_v * across_v + rest[6] * loads;
            let (of_u, of_v) = (of_u * along_u, of_v * along_v);
            for c in 0..3 {
                blocks[j][c] = of_u * u[c] * u[c] + of_v * v[c] * v[c] + rest[6] * g[c] * g[c] + across;
            }
            for c in 0..3 {
                let [p, q] = OFF_DIAGONAL[c];
                blocks[j][3 + c] = of_u * u[p] * u[q] + of_v * v[p] * v[q] + rest[6] * g[p] * g[q];
            }
        }
        blocks
    }

    fn shares(rest: [f64; 7]) -> [f64; 3] {
        // |sum of a_j w_j|² <= (sum of |a_j|) (sum of |a_j| |w_j|²), of w_u and w_v, and so of the g_j, which at rest are as long
        // as [a_j, b_j].
        let [a1, a2, b1, b2, warp, weft, shear] = rest;
        let (a, b) = ([-a1 - a2, a1, a2], [-b1 - b2, b1, b2]);
        let g: [f64; 3] = std::array::from_fn(|j| a[j].hypot(b[j]));
        let total = |of: [f64; 3]| of.iter().map(|number| number.abs()).sum::<f64>();
        let (of_a, of_b, of_g) = (warp * total(a), weft * total(b), shear * total(g));
        std::array::from_fn(|j| of_a * a[j].abs() + of_b * b[j].abs() + of_g * g[j])
    }

    #[inline(always)]
    fn beyond<P: Pack>(rest: [P; 7], x: [[P; 3]; 3]) -> Beyond<P, 3> {
        let ([u, v], (a, b)) = (stretched(rest, x), three_of(rest));
        let (warp, weft, shear) = (Thread::new(u), Thread::new(v), dot(u, v).abs());
        let (mut g, mut at_rest) = ([P::zero(); 3], [P::zero(); 3]);
        for j in 0..3 {
            let now = three!(|c| a[j] * v[c] + b[j] * u[c]);
            g[j] = dot(now, now).sqrt();
            at_rest[j] = (a[j] * a[j] + b[j] * b[j]).sqrt();
        }
        let of_g = g[0] + g[1] + g[2];
        let of_rest = at_rest[0] + at_rest[1] + at_rest[2];
        let of_a = a[0].abs() + a[1].abs() + a[2].abs();
        let of_b = b[0].abs() + b[1].abs() + b[2].abs();

        let (of_warp, of_weft) = (rest[4] * warp.tension() * of_a, rest[5] * weft.tension() * of_b);
        let mut found = Beyond { all: [P::zero(); 3], loads: [P::zero(); 3] };
        for j in 0..3 {
            // 2 |dw_u . dw_v| <= |dw_u|² + |dw_v|².
            let turned = rest[6] * shear * (of_a * a[j].abs() + of_b * b[j].abs());
            let more = rest[6] * (of_g * g[j] - of_rest * at_rest[j]);
            found.all[j] = more.max(P::zero()) + turned;
            found.loads[j] = of_warp * a[j].abs() + of_weft * b[j].abs() + turned;
        }
        found
    }

    #[inline(always)]
    fn rate<P: Pack>(rest: [P; 7], v: [[P; 3]; 3]) -> P {
        let [of_u, of_v] = stretched(rest, v);
        dot(of_u, of_u).max(dot(of_v, of_v))
    }

    fn size(rest: [f64; 7]) -> f64 {
        // The numbers are those of the inverse of a matrix whose determinant is twice the area.
        let [a1, a2, b1, b2, ..] = rest;
        (a1 * b2 - a2 * b1).abs().sqrt().recip()
    }
}

/// Numbers of an element from where its particles are at rest (m), and the direction of its warp: those of the second and the
/// third particle, of warp and weft (1/m), and the area times each share (m²). None where it has no shape to resist with.
fn rest([a, b, c]: [[f64; 3]; 3], warp: [f64; 3], shares: [f64; 3]) -> Option<[f64; 7]> {
    let (one, other) = (minus(b, a), minus(c, a));
    let normal = cross(one, other);
    let twice = length(normal);
    let weft = cross(normal, warp).map(|c| c / twice);
    let [p, q] = [one, other].map(|side| [dot(side, warp), dot(side, weft)]);
    let determinant = p[0] * q[1] - p[1] * q[0];
    let [of_warp, of_weft, of_shear] = shares.map(|share| 0.5 * twice * share);
    let [a1, a2, b1, b2] = [q[1], -p[1], -q[0], p[0]].map(|number| number / determinant);
    let numbers = [a1, a2, b1, b2, of_warp, of_weft, of_shear];
    let is_shape = determinant > 0.0 && numbers.iter().all(|number| number.is_finite());
    is_shape.then_some(numbers)
}

/// The numbers of all three particles, of warp and weft: they add to 0.
#[inline(always)]
fn three_of<P: Pack>(rest: [P; 7]) -> ([P; 3], [P; 3]) {
    let (a, b) = (rest[0] + rest[1], rest[2] + rest[3]);
    ([P::zero() - a, rest[0], rest[1]], [P::zero() - b, rest[2], rest[3]])
}

/// w_u and w_v, as a_j (x_j - x_0) and b_j (x_j - x_0).
#[inline(always)]
fn stretched<P: Pack>(rest: [P; 7], x: [[P; 3]; 3]) -> [[P; 3]; 2] {
    let (one, other) = (three!(|c| x[1][c] - x[0][c]), three!(|c| x[2][c] - x[0][c]));
    [three!(|c| rest[0] * one[c] + rest[1] * other[c]), three!(|c| rest[2] * one[c] + rest[3] * other[c])]
}

/// At each particle both vectors, multiplied by its numbers and added.
#[inline(always)]
fn spread<P: Pack>(rest: [P; 7], [u, v]: [[P; 3]; 2]) -> [[P; 3]; 3] {
    let one = three!(|c| rest[0] * u[c] + rest[2] * v[c]);
    let other = three!(|c| rest[1] * u[c] + rest[3] * v[c]);
    [three!(|c| P::zero() - (one[c] + other[c])), one, other]
}

/// W in binary64, of the positions as they are.
#[inline(always)]
fn energy<P: Pack>(rest: [P; 7], x: [[P; 3]; 3]) -> P::Wide {
    let mut wide = [P::Wide::zero(); 7];
    for c in 0..7 {
        wide[c] = rest[c].widen();
    }
    let [u, v] = stretched(wide, [P::widen3(x[0]), P::widen3(x[1]), P::widen3(x[2])]);
    let (one, shear) = (P::Wide::one(), dot(u, v));
    let (warp, weft) = (dot(u, u).sqrt() - one, dot(v, v).sqrt() - one);
    P::Wide::of(0.5) * (wide[4] * warp * warp + wide[5] * weft * weft + wide[6] * shear * shear)
}

/// A unit at rest along a thread, as it is now.
#[derive(Clone, Copy)]
struct Thread<P> {
    length: P,
    /// 1 / length, 0 where it is too short to have a direction.
    inverse: P,
    strain: P,
}

impl<P: Pack> Thread<P> {
    #[inline(always)]
    fn new(w: [P; 3]) -> Self {
        let length = dot(w, w).sqrt();
        let inverse = length.inverse_above(P::of(P::Number::SMALLEST));
        Self { length, inverse, strain: length - P::one() }
    }

    /// What w wᵀ and I are multiplied by in the derivative of its pull. Without a direction it is that of a spring without
    /// a rest length, as under loads.
    #[inline(always)]
    fn tangent(self, Treatment { mirror, elastic }: Treatment<P>) -> [P; 2] {
        let shorter = self.inverse.min(P::of(most_compressed::<P::Number>()));
        let ratio = P::one() - shorter;
        let across = elastic * (mirror * ratio).max(ratio);
        [(P::one() - across) * self.inverse * self.inverse, across]
    }

    /// Stiffness across it over that along it, 1 - 1/length, 0 under compression.
    #[inline(always)]
    fn tension(self) -> P {
        (P::one() - self.inverse).max(P::zero())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Portable, Vec3};

    type Lane = Portable<f64>;

    const CORNERS: [[f64; 3]; 3] = [[0.1, 0.2, 0.0], [1.3, 0.1, 0.0], [0.4, 1.1, 0.0]];
    const SHARES: [f64; 3] = [1.0, 0.6, 0.05];

    /// Numbers at rest, the warp at an angle from x.
    fn at_rest(angle: f64) -> [f64; 7] {
        rest(CORNERS, [libm::cos(angle), libm::sin(angle), 0.0], SHARES).expect("a triangle")
    }

    fn evaluate(rest: [f64; 7], x: [[f64; 3]; 3], mirror: f64) -> (f64, [Lane; 12], f64) {
        let treatment = Treatment { mirror: Lane::splat(mirror), elastic: Lane::one() };
        let x = x.map(|x| x.map(Lane::splat));
        let found = Membrane::evaluate(rest.map(Lane::splat), x, treatment);
        (found.energy.store()[0], found.frozen, found.stretch.store()[0])
    }

    /// Corners under a map of the plane into space.
    fn mapped(of: impl Fn(f64, f64) -> [f64; 3]) -> [[f64; 3]; 3] {
        CORNERS.map(|[x, y, _]| of(x, y))
    }

    #[test]
    fn pulls_along_the_threads_and_shear_have_the_energy_of_their_strain() {
        let area = 0.5 * length(cross(minus(CORNERS[1], CORNERS[0]), minus(CORNERS[2], CORNERS[0])));
        let (strain, shear) = (0.1, 0.2);
        let of = |angle: f64, x: [[f64; 3]; 3]| evaluate(at_rest(angle), x, 1.0).0 / area;
        let longer = mapped(|x, y| [(1.0 + strain) * x, y, 0.0]);
        let quarter = std::f64::consts::FRAC_PI_2;
        assert!((of(0.0, longer) - 0.5 * SHARES[0] * strain * strain).abs() < 1e-15);
        assert!((of(quarter, longer) - 0.5 * SHARES[1] * strain * strain).abs() < 1e-15);

        // Under a shear of the plane the warp keeps its length, and the weft grows.
        let sheared = mapped(|x, y| [x + shear * y, y, 0.0]);
        let weft = f64::hypot(1.0, shear) - 1.0;
        let expected = 0.5 * (SHARES[1] * weft * weft + SHARES[2] * shear * shear);
        assert!((of(0.0, sheared) - expected).abs() < 1e-15);

        // At an angle: lengths and product of the threads under the same pull.
        let angle = quarter / 3.0;
        let (sine, cosine) = angle.sin_cos();
        let pulled = [[cosine, sine], [-sine, cosine]].map(|[x, y]| [(1.0 + strain) * x, y]);
        let [warp, weft] = pulled.map(|[x, y]| f64::hypot(x, y) - 1.0);
        let product = pulled[0][0] * pulled[1][0] + pulled[0][1] * pulled[1][1];
        let terms = [SHARES[0] * warp * warp, SHARES[1] * weft * weft, SHARES[2] * product * product];
        assert!((of(angle, longer) - 0.5 * terms.iter().sum::<f64>()).abs() < 1e-15);

        let (_, _, stretch) = evaluate(at_rest(angle), longer, 1.0);
        assert!((stretch - 1.0 - warp.max(weft)).abs() < 1e-14, "{stretch}");
    }

    #[test]
    fn what_damps_is_nothing_in_a_rotation_under_loads() {
        let rest = at_rest(0.4);
        let x = mapped(|x, y| [1.3 * x + 0.2 * y, 0.8 * y - 0.1 * x, 0.3 * x]);
        let still = Treatment { mirror: Lane::one(), elastic: Lane::zero() };
        let lanes = x.map(|x| x.map(Lane::splat));
        let frozen = Membrane::evaluate(rest.map(Lane::splat), lanes, still).frozen;
        let turned: [[f64; 3]; 3] = x.map(|x| Vec3::new(0.3, -0.7, 1.1).cross(&Vec3::from(x)).into());
        let turned = turned.map(|v| v.map(Lane::splat));
        let push = Membrane::product(rest.map(Lane::splat), frozen, turned);
        for number in push.as_flattened() {
            assert!(number.store()[0].abs() < 1e-14, "{}", number.store()[0]);
        }
    }

    #[test]
    fn treatments_differ_under_compression_and_shear_alone() {
        let rest = at_rest(0.0);
        let form = |x: [[f64; 3]; 3], mirror: f64| {
            let (_, frozen, _) = evaluate(rest, x, mirror);
            let w = [[0.0, 0.0, 0.3], [0.0, 0.0, -0.5], [0.0, 0.0, 0.9]].map(|w| w.map(Lane::splat));
            let product = Membrane::product(rest.map(Lane::splat), frozen, w);
            let terms = product.as_flattened().iter().zip(w.as_flattened());
            terms.map(|(a, b)| a.store()[0] * b.store()[0]).sum::<f64>()
        };
        let short = mapped(|x, y| [0.8 * x, 0.9 * y, 0.0]);
        let [full, clamped, absolute] = [1.0, 0.0, -1.0].map(|mirror| form(short, mirror));
        assert!(full < -1e-3, "{full}");
        assert!(clamped.abs() < 1e-15 && (absolute + full).abs() < 1e-15, "{full}, {clamped}, {absolute}");
        let long = mapped(|x, y| [1.1 * x, 1.3 * y, 0.0]);
        assert!((form(long, 1.0) - form(long, -1.0)).abs() < 1e-15);
        let sheared = mapped(|x, y| [x + 0.2 * y, (1.0_f64 - 0.04).sqrt() * y, 0.0]);
        let [full, clamped, absolute] = [1.0, 0.0, -1.0].map(|mirror| form(sheared, mirror));
        assert!(full < clamped && clamped < absolute, "{full}, {clamped}, {absolute}");
    }

    #[test]
    fn thin_and_collapsed_triangles_stay_finite() {
        let thin = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 1e-9, 0.0]];
        let numbers = rest(thin, [1.0, 0.0, 0.0], SHARES).expect("a thin triangle");
        assert!(numbers.iter().all(|number| number.is_finite()));
        assert!(rest([[0.5, 0.25, 1.0]; 3], [1.0, 0.0, 0.0], SHARES).is_none());

        let (energy, frozen, stretch) = evaluate(at_rest(0.3), [[0.2; 3]; 3], -1.0);
        assert!(energy > 0.0 && energy.is_finite() && stretch == 0.0, "{energy}, {stretch}");
        assert!(frozen.iter().all(|number| number.store()[0].is_finite()));
    }

    #[test]
    fn sizes_are_about_those_of_sides() {
        let expected = (2.0 * at_rest(0.7)[4]).sqrt();
        assert!((Membrane::size(at_rest(0.7)) / expected - 1.0).abs() < 1e-12);
    }
}
