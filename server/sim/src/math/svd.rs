//! Signed singular value decomposition of sixteen 3 x 3 matrices at a time, by one-sided Jacobi.
//!
//! Reads F; writes U, sigma, V with F = U diag(sigma) V^T, U and V rotations (det +1), and the sign
//! of det F on the singular value of least magnitude, which is the last. Columns of F are turned
//! until they are orthogonal (Hestenes 1958; Demmel and Veselic 1992): small singular values are as
//! exact as large ones, which an eigenvalue solver on F^T F cannot be. A lane's result does not
//! depend on the other lanes.

use super::{Kernel, LANES, Pack, Real, dispatch};

/// A matrix a lane, by columns: `m[column][row]`.
pub(crate) type Columns<P> = [[P; 3]; 3];

/// F = U diag(sigma) V^T.
#[derive(Clone, Copy)]
pub(crate) struct Svd<P> {
    pub(crate) u: Columns<P>,
    pub(crate) sigma: [P; 3],
    pub(crate) v: Columns<P>,
}

/// Sweeps of three rotations, at most: each squares what is left of the angles between columns.
const SWEEPS: usize = 8;

#[inline(always)]
pub(crate) fn dot3<R: Real, P: Pack<R>>(a: &[P; 3], b: &[P; 3]) -> P {
    a[0].mul(b[0]).add(a[1].mul(b[1])).add(a[2].mul(b[2]))
}

#[inline(always)]
pub(crate) fn cross3<R: Real, P: Pack<R>>(a: &[P; 3], b: &[P; 3]) -> [P; 3] {
    [
        a[1].mul(b[2]).sub(a[2].mul(b[1])),
        a[2].mul(b[0]).sub(a[0].mul(b[2])),
        a[0].mul(b[1]).sub(a[1].mul(b[0])),
    ]
}

/// Columns p and q turned by (c, s).
#[inline(always)]
fn turn<R: Real, P: Pack<R>>(m: &mut Columns<P>, p: usize, q: usize, c: P, s: P) {
    for k in 0..3 {
        let (a, b) = (m[p][k], m[q][k]);
        m[p][k] = c.mul(a).sub(s.mul(b));
        m[q][k] = s.mul(a).add(c.mul(b));
    }
}

/// Cosine and sine that make columns p and q orthogonal: (1, 0) where they are, to rounding.
#[inline(always)]
fn rotation<R: Real, P: Pack<R>>(b: &Columns<P>, p: usize, q: usize) -> (P, P) {
    let (zero, one) = (P::splat(R::zero()), P::splat(R::one()));
    let (pp, qq, pq) = (dot3(&b[p], &b[p]), dot3(&b[q], &b[q]), dot3(&b[p], &b[q]));
    let far = is_far(pp, qq, pq);
    // tan of the smaller angle: 2 pq / (|qq - pp| + sqrt((qq - pp)² + 4 pq²)), with a sign.
    let difference = qq.sub(pp);
    let twice = pq.add(pq).mul(one.with_sign_of(difference));
    let reach = difference.abs().add(difference.mul(difference).add(twice.mul(twice)).sqrt());
    let inverse = one.div(reach.mul(reach).add(twice.mul(twice)).sqrt());
    (zero.if_less(far, reach.mul(inverse), one), zero.if_less(far, twice.mul(inverse), zero))
}

/// 1 where |cos| of the angle between two columns is above rounding, else 0.
#[inline(always)]
fn is_far<R: Real, P: Pack<R>>(pp: P, qq: P, pq: P) -> P {
    let tolerance = P::splat(R::of(16.0 * R::ROUNDING * R::ROUNDING));
    tolerance.mul(pp).mul(qq).if_less(pq.mul(pq), P::splat(R::one()), P::splat(R::zero()))
}

/// Whether columns of any lane are not yet orthogonal.
#[inline(always)]
fn any_far<R: Real, P: Pack<R>>(b: &Columns<P>) -> bool {
    let own = [dot3(&b[0], &b[0]), dot3(&b[1], &b[1]), dot3(&b[2], &b[2])];
    let far = is_far(own[0], own[1], dot3(&b[0], &b[1]));
    let far = far.add(is_far(own[0], own[2], dot3(&b[0], &b[2])));
    far.add(is_far(own[1], own[2], dot3(&b[1], &b[2]))).fold() != [R::zero(); 4]
}

/// Turns the columns of `K` packs until they are orthogonal. Several at once, since a rotation
/// waits for the one before.
#[inline(always)]
pub(crate) fn orthogonalize<R: Real, P: Pack<R>, const K: usize>(b: &mut [Columns<P>; K]) {
    for _ in 0..SWEEPS {
        let mut far = false;
        for k in 0..K {
            far |= any_far(&b[k]);
        }
        if !far {
            break;
        }
        turn_all::<R, P, K, 0, 1>(b);
        turn_all::<R, P, K, 0, 2>(b);
        turn_all::<R, P, K, 1, 2>(b);
    }
}

/// Turns columns `A` and `B` of each pack: constants, so that columns stay in registers.
#[inline(always)]
fn turn_all<R: Real, P: Pack<R>, const K: usize, const A: usize, const B: usize>(b: &mut [Columns<P>; K]) {
    let mut turns = [(P::splat(R::zero()), P::splat(R::zero())); K];
    for k in 0..K {
        turns[k] = rotation(&b[k], A, B);
    }
    for k in 0..K {
        turn(&mut b[k], A, B, turns[k].0, turns[k].1);
    }
}

/// Puts column q before column p where it is longer, as a rotation: (a, b) becomes (b, -a).
#[inline(always)]
fn order<R: Real, P: Pack<R>>(
    b: &mut Columns<P>,
    v: &mut Columns<P>,
    length2: &mut [P; 3],
    p: usize,
    q: usize,
) {
    let zero = P::splat(R::zero());
    let (long_p, long_q) = (length2[p], length2[q]);
    for m in [b, v] {
        for k in 0..3 {
            let (x, y) = (m[p][k], m[q][k]);
            m[p][k] = long_p.if_less(long_q, y, x);
            m[q][k] = long_p.if_less(long_q, zero.sub(x), y);
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

impl<R: Real> Kernel<R> for Decompose<'_, R> {
    const WIDE_BINARY64: bool = false;
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<R>>(self) {
        let Svd { u, sigma, v } = decompose(&load::<R, P>(self.f));
        *self.u = store(&u);
        *self.v = store(&v);
        for k in 0..3 {
            self.sigma[k] = sigma[k].store();
        }
    }
}

#[inline(always)]
fn load<R: Real, P: Pack<R>>(stored: &Stored<R>) -> Columns<P> {
    let mut m = [[P::splat(R::zero()); 3]; 3];
    for column in 0..3 {
        for row in 0..3 {
            m[column][row] = P::load(&stored[column][row]);
        }
    }
    m
}

#[inline(always)]
fn store<R: Real, P: Pack<R>>(m: &Columns<P>) -> Stored<R> {
    let mut stored = [[[R::zero(); LANES]; 3]; 3];
    for column in 0..3 {
        for row in 0..3 {
            stored[column][row] = m[column][row].store();
        }
    }
    stored
}

/// The decomposition of F, given by columns.
#[inline(always)]
pub(crate) fn svd<R: Real, P: Pack<R>>(f: &Columns<P>) -> Svd<P> {
    let zero = [[[R::zero(); LANES]; 3]; 3];
    let (mut u, mut sigma, mut v) = (zero, zero[0], zero);
    dispatch(Decompose { f: &store(f), u: &mut u, sigma: &mut sigma, v: &mut v });
    let sigma = [P::load(&sigma[0]), P::load(&sigma[1]), P::load(&sigma[2])];
    Svd { u: load(&u), sigma, v: load(&v) }
}

#[inline(always)]
fn decompose<R: Real, P: Pack<R>>(f: &Columns<P>) -> Svd<P> {
    let (zero, one) = (P::splat(R::zero()), P::splat(R::one()));
    let mut b = *f;
    let mut v = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    for _ in 0..SWEEPS {
        if !any_far(&b) {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let (c, s) = rotation(&b, p, q);
            turn(&mut b, p, q, c, s);
            turn(&mut v, p, q, c, s);
        }
    }
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
fn unit<R: Real, P: Pack<R>>(b: &[P; 3], length: P, otherwise: &[P; 3]) -> [P; 3] {
    let least = P::splat(R::of(R::SMALLEST));
    let inverse = P::splat(R::one()).div(length);
    [
        length.if_less(least, otherwise[0], b[0].mul(inverse)),
        length.if_less(least, otherwise[1], b[1].mul(inverse)),
        length.if_less(least, otherwise[2], b[2].mul(inverse)),
    ]
}

/// A unit vector at right angles to a unit vector.
#[inline(always)]
fn across<R: Real, P: Pack<R>>(u: &[P; 3]) -> [P; 3] {
    let (zero, one, half) = (P::splat(R::zero()), P::splat(R::one()), P::splat(R::of(0.5)));
    // u x e_x unless u lies along x, then u x e_y.
    let along = u[0].mul(u[0]);
    let (by_x, by_y) = (half.if_less(along, zero, one), half.if_less(along, one, zero));
    let w = cross3(u, &[by_x, by_y, zero]);
    let inverse = one.div(dot3(&w, &w).sqrt());
    [w[0].mul(inverse), w[1].mul(inverse), w[2].mul(inverse)]
}
