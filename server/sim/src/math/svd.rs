//! Signed singular value decomposition of sixteen 3 x 3 matrices at a time, by one-sided Jacobi.
//!
//! Reads F; writes U, sigma, V with F = U diag(sigma) V^T, U and V rotations (det +1), and the sign
//! of det F on the singular value of least magnitude, which is the last. Columns of F are turned
//! until they are orthogonal (Hestenes 1958; Demmel and Veselic 1992): small singular values are as
//! exact as large ones, which an eigenvalue solver on F^T F cannot be. A lane's result does not
//! depend on the other lanes, so that the work goes register by register: nine numbers of a lane are what sixteen
//! registers have room for.

use super::{
    LANES, Lanes, Pack, Real, Register, WithSimd,
    array::{cross, dot, three},
    dispatch,
};

/// A matrix a lane, by columns: `m[column][row]`.
pub(crate) type Columns<P> = [[P; 3]; 3];

/// F = U diag(sigma) V^T.
#[derive(Clone, Copy)]
pub(crate) struct Svd<P> {
    pub(crate) u: Columns<P>,
    pub(crate) sigma: [P; 3],
    pub(crate) v: Columns<P>,
}

/// The same matrix with +0 in the place of every -0: what comes of a zero does not depend on its sign.
#[inline(always)]
fn without_negative_zeros<P: Register>(m: &Columns<P>) -> Columns<P> {
    let mut out = *m;
    for column in &mut out {
        for entry in column {
            *entry += P::zero();
        }
    }
    out
}

/// Sweeps of three rotations, at most: each squares what is left of the angles between columns.
const SWEEPS: usize = 8;

#[inline(always)]
pub(crate) fn dot3<P: Lanes>(a: &[P; 3], b: &[P; 3]) -> P {
    dot(*a, *b)
}

#[inline(always)]
pub(crate) fn cross3<P: Lanes>(a: &[P; 3], b: &[P; 3]) -> [P; 3] {
    cross(*a, *b)
}

/// A turn of two columns: cosine, sine, and 1 in the lanes that need it, else 0.
type Turn<P> = (P, P, P);

/// Columns p and q turned where they need it. Others stay as they are: 1 x - 0 y is not x where y is infinite.
#[inline(always)]
fn turn<P: Register>(m: &mut Columns<P>, p: usize, q: usize, (c, s, far): Turn<P>) {
    let zero = P::zero();
    for k in 0..3 {
        let (a, b) = (m[p][k], m[q][k]);
        m[p][k] = zero.if_less(far, c * a - s * b, a);
        m[q][k] = zero.if_less(far, s * a + c * b, b);
    }
}

/// The turn that makes columns p and q orthogonal, needed where they are not, to rounding.
#[inline(always)]
fn rotation<P: Register>(b: &Columns<P>, p: usize, q: usize) -> Turn<P> {
    let one = P::one();
    let (pp, qq, pq) = (dot3(&b[p], &b[p]), dot3(&b[q], &b[q]), dot3(&b[p], &b[q]));
    let far = is_far(pp, qq, pq);
    // tan of the smaller angle: 2 pq / (|qq - pp| + sqrt((qq - pp)² + 4 pq²)), with a sign.
    let difference = qq - pp;
    let twice = (pq + pq) * one.with_sign_of(difference);
    let reach = difference.abs() + (difference * difference + twice * twice).sqrt();
    let inverse = one / (reach * reach + twice * twice).sqrt();
    (reach * inverse, twice * inverse, far)
}

/// 1 where |cos| of the angle between two columns is above rounding, else 0.
#[inline(always)]
fn is_far<P: Register>(pp: P, qq: P, pq: P) -> P {
    let tolerance = P::splat(P::Number::of(16.0 * P::Number::ROUNDING * P::Number::ROUNDING));
    (tolerance * pp * qq).if_less(pq * pq, P::one(), P::zero())
}

/// Whether columns of any lane are not yet orthogonal.
#[inline(always)]
fn any_far<P: Register>(b: &Columns<P>) -> bool {
    let own = [dot3(&b[0], &b[0]), dot3(&b[1], &b[1]), dot3(&b[2], &b[2])];
    let far = is_far(own[0], own[1], dot3(&b[0], &b[1]));
    let far = far + is_far(own[0], own[2], dot3(&b[0], &b[2]));
    (far + is_far(own[1], own[2], dot3(&b[1], &b[2]))).any()
}

/// Turns the columns of `K` packs until they are orthogonal: a register of each at a time.
#[inline(always)]
pub(crate) fn orthogonalize<P: Pack, const K: usize>(b: &mut [Columns<P>; K]) {
    for part in 0..P::Register::PARTS {
        let mut columns = [[[P::Register::zero(); 3]; 3]; K];
        for k in 0..K {
            columns[k] = three!(|column| three!(|row| b[k][column][row].register(part)));
        }
        orthogonalize_registers(&mut columns);
        for k in 0..K {
            for column in 0..3 {
                for row in 0..3 {
                    b[k][column][row].set_register(part, columns[k][column][row]);
                }
            }
        }
    }
}

/// Turns the columns of `K` registers until they are orthogonal. Several at once, since a rotation
/// waits for the one before.
#[inline(always)]
fn orthogonalize_registers<P: Register, const K: usize>(b: &mut [Columns<P>; K]) {
    for columns in b.iter_mut() {
        *columns = without_negative_zeros(columns);
    }
    for _ in 0..SWEEPS {
        let mut far = false;
        for k in 0..K {
            far |= any_far(&b[k]);
        }
        if !far {
            break;
        }
        turn_all::<P, K, 0, 1>(b, None);
        turn_all::<P, K, 0, 2>(b, None);
        // In the last sweep the turns before left these as they were, most often: orthogonal.
        if any_far_of::<P, K, 1, 2>(b) {
            turn_all::<P, K, 1, 2>(b, None);
        }
    }
}

/// Whether columns `A` and `B` of any lane are not yet orthogonal.
#[inline(always)]
fn any_far_of<P: Register, const K: usize, const A: usize, const B: usize>(b: &[Columns<P>; K]) -> bool {
    let mut far = P::zero();
    for k in 0..K {
        far += is_far(dot3(&b[k][A], &b[k][A]), dot3(&b[k][B], &b[k][B]), dot3(&b[k][A], &b[k][B]));
    }
    far.any()
}

/// Turns columns `A` and `B` of each register: constants, so that columns stay where they are.
#[inline(always)]
fn turn_all<P: Register, const K: usize, const A: usize, const B: usize>(
    b: &mut [Columns<P>; K],
    v: Option<&mut [Columns<P>; K]>,
) {
    let mut turns = [(P::zero(), P::zero(), P::zero()); K];
    for k in 0..K {
        turns[k] = rotation(&b[k], A, B);
    }
    for k in 0..K {
        turn(&mut b[k], A, B, turns[k]);
    }
    if let Some(v) = v {
        for k in 0..K {
            turn(&mut v[k], A, B, turns[k]);
        }
    }
}

/// Puts column q before column p where it is longer, as a rotation: (a, b) becomes (b, -a).
#[inline(always)]
fn order<P: Register>(b: &mut Columns<P>, v: &mut Columns<P>, length2: &mut [P; 3], p: usize, q: usize) {
    let (long_p, long_q) = (length2[p], length2[q]);
    for m in [b, v] {
        for k in 0..3 {
            let (x, y) = (m[p][k], m[q][k]);
            m[p][k] = long_p.if_less(long_q, y, x);
            m[q][k] = long_p.if_less(long_q, P::zero() - x, y);
        }
    }
    length2[p] = long_p.if_less(long_q, long_q, long_p);
    length2[q] = long_p.if_less(long_q, long_p, long_q);
}

/// A matrix a lane, by columns, in memory.
type Stored<R> = [[[R; LANES]; 3]; 3];

/// The decomposition as a kernel of its own: compiled once, called from others.
struct Decompose<'a, R> {
    f: &'a Stored<R>,
    u: &'a mut Stored<R>,
    sigma: &'a mut [[R; LANES]; 3],
    v: &'a mut Stored<R>,
}

impl<R: Real> WithSimd<R> for Decompose<'_, R> {
    const WIDE_BINARY64: bool = false;
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        if const { P::Register::PARTS == 1 } {
            self.by::<P::Register, 1>();
        } else {
            self.by::<P::Register, 2>();
        }
    }
}

impl<R: Real> Decompose<'_, R> {
    /// Decomposes the lanes of `K` registers at a time.
    #[inline(always)]
    fn by<P: Register<Number = R>, const K: usize>(self) {
        for first in (0..P::PARTS).step_by(K) {
            let mut f = [[[P::zero(); 3]; 3]; K];
            for k in 0..K {
                f[k] = three!(|column| three!(|row| P::load_part(&self.f[column][row], first + k)));
            }
            let decomposed = decompose(&f);
            for k in 0..K {
                let Svd { u, sigma, v } = decomposed[k];
                for column in 0..3 {
                    sigma[column].store_part(&mut self.sigma[column], first + k);
                    for row in 0..3 {
                        u[column][row].store_part(&mut self.u[column][row], first + k);
                        v[column][row].store_part(&mut self.v[column][row], first + k);
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn load<P: Pack>(stored: &Stored<P::Number>) -> Columns<P> {
    let mut m = [[P::zero(); 3]; 3];
    for column in 0..3 {
        for row in 0..3 {
            m[column][row] = P::load(&stored[column][row]);
        }
    }
    m
}

#[inline(always)]
fn store<P: Pack>(m: &Columns<P>) -> Stored<P::Number> {
    let mut stored = [[[P::Number::default(); LANES]; 3]; 3];
    for column in 0..3 {
        for row in 0..3 {
            stored[column][row] = m[column][row].store();
        }
    }
    stored
}

/// The decomposition of F, given by columns.
#[inline(always)]
pub(crate) fn svd<P: Pack>(f: &Columns<P>) -> Svd<P> {
    let zero = [[[P::Number::default(); LANES]; 3]; 3];
    let (mut u, mut sigma, mut v) = (zero, zero[0], zero);
    dispatch(Decompose { f: &store(f), u: &mut u, sigma: &mut sigma, v: &mut v });
    let sigma = [P::load(&sigma[0]), P::load(&sigma[1]), P::load(&sigma[2])];
    Svd { u: load(&u), sigma, v: load(&v) }
}

#[inline(always)]
fn decompose<P: Register, const K: usize>(f: &[Columns<P>; K]) -> [Svd<P>; K] {
    let (zero, one) = (P::zero(), P::one());
    let mut b = *f;
    for columns in &mut b {
        *columns = without_negative_zeros(columns);
    }
    let mut v = [[[one, zero, zero], [zero, one, zero], [zero, zero, one]]; K];
    for _ in 0..SWEEPS {
        let mut far = false;
        for k in 0..K {
            far |= any_far(&b[k]);
        }
        if !far {
            break;
        }
        turn_all::<P, K, 0, 1>(&mut b, Some(&mut v));
        turn_all::<P, K, 0, 2>(&mut b, Some(&mut v));
        turn_all::<P, K, 1, 2>(&mut b, Some(&mut v));
    }

    let mut out = [Svd { u: b[0], sigma: b[0][0], v: v[0] }; K];
    for k in 0..K {
        out[k] = in_order(b[k], v[k]);
    }
    out
}

/// From the columns U diag(sigma), and V.
#[inline(always)]
fn in_order<P: Register>(mut b: Columns<P>, mut v: Columns<P>) -> Svd<P> {
    let (zero, one) = (P::zero(), P::one());
    let mut length2 = [dot3(&b[0], &b[0]), dot3(&b[1], &b[1]), dot3(&b[2], &b[2])];
    order(&mut b, &mut v, &mut length2, 0, 2);
    order(&mut b, &mut v, &mut length2, 1, 2);
    order(&mut b, &mut v, &mut length2, 0, 1);
    let (s0, s1) = (length2[0].sqrt(), length2[1].sqrt());
    let u0 = unit(&b[0], s0, &[one, zero, zero]);
    // Where F has rank 1, any direction across the first will do: the axis that leans least on it.
    let u1 = unit(&b[1], s1, &across(&u0));
    let u2 = cross3(&u0, &u1);
    let s2 = dot3(&b[2], &u2);
    Svd { u: [u0, u1, u2], sigma: [s0, s1, s2], v }
}

/// b / length, or `otherwise` where the length vanishes.
#[inline(always)]
fn unit<P: Register>(b: &[P; 3], length: P, otherwise: &[P; 3]) -> [P; 3] {
    let least = P::splat(P::Number::of(P::Number::SMALLEST));
    let inverse = P::one() / length;
    [
        length.if_less(least, otherwise[0], b[0] * inverse),
        length.if_less(least, otherwise[1], b[1] * inverse),
        length.if_less(least, otherwise[2], b[2] * inverse),
    ]
}

/// A unit vector at right angles to a unit vector.
#[inline(always)]
fn across<P: Register>(u: &[P; 3]) -> [P; 3] {
    let (zero, one, half) = (P::zero(), P::one(), P::splat(P::Number::of(0.5)));
    // u x e_x unless u lies along x, then u x e_y.
    let along = u[0] * u[0];
    let (by_x, by_y) = (half.if_less(along, zero, one), half.if_less(along, one, zero));
    let w = cross3(u, &[by_x, by_y, zero]);
    let inverse = one / dot3(&w, &w).sqrt();
    [w[0] * inverse, w[1] * inverse, w[2] * inverse]
}

#[cfg(test)]
mod tests {
    use super::{Columns, Svd, orthogonalize, svd};
    use crate::math::{LANES, Pack, Portable};

    /// What entries are: zeros of both signs among others; infinite ones; what underflows, to zeros of both signs, and overflows.
    const NUMBERS: [[f64; 10]; 3] = [
        [0.0, -0.0, 1.0, -1.0, 0.5, -0.0, 0.0, 1.0 / 3.0, -1e-9, 0.0],
        [0.0, -0.0, 1.0, f64::INFINITY, 0.5, -1.0, f64::NEG_INFINITY, 1.0 / 3.0, -1e-9, 0.0],
        [0.0, -5e-324, 1.0, -1e-310, 0.5, -1e200, 3e-162, 1.0 / 3.0, -1e90, 2e-308],
    ];

    /// A matrix of few different numbers.
    fn matrix(numbers: &[f64; 10], salt: usize) -> [f64; 9] {
        std::array::from_fn(|i| numbers[(salt * (7 + 2 * i) + salt / 10 * (3 + i) + i * i) % numbers.len()])
    }

    /// Bits of the first lane of both decompositions, where the other lanes hold other matrices.
    fn first(lanes: &[[f64; 9]; LANES]) -> Vec<u64> {
        let entry = |i: usize| Portable::load(&std::array::from_fn(|lane| lanes[lane][i]));
        let f: Columns<Portable<f64>> = [0, 1, 2].map(|column| [0, 1, 2].map(|row| entry(3 * column + row)));
        let Svd { u, sigma, v } = svd(&f);
        let mut turned = [f];
        orthogonalize(&mut turned);
        let all = u.into_iter().chain(v).chain(turned[0]).flatten().chain(sigma);
        all.map(|pack| pack.store()[0].to_bits()).collect()
    }

    #[test]
    fn a_lane_does_not_depend_on_the_others() {
        for (numbers, salt) in NUMBERS.iter().flat_map(|numbers| (0..500).map(move |salt| (numbers, salt))) {
            let own = matrix(numbers, salt);
            let alone = first(&[own; LANES]);
            for others in 1..20 {
                let mut lanes =
                    std::array::from_fn(|lane| matrix(&NUMBERS[lane % 3], salt + 31 * lane * others));
                lanes[0] = own;
                assert!(first(&lanes) == alone, "{own:?} among {lanes:?}");
            }
        }
    }
}
