//! Work on one block of vectors, stored one after another: sums of products, and linear combinations. Sums of
//! products and of their magnitudes are in binary64 and in a fixed order of lanes.

use super::sixteens::add_lanes;
use crate::math::{LANES, Pack, Real, Vec3, WithSimd, dispatch};

/// The components of vectors, x y z after one another.
#[inline(always)]
#[allow(unsafe_code, reason = "a 3-vector is laid out as an array of three numbers")]
fn flat<R: Real>(v: &[Vec3<R>]) -> &[R] {
    const { assert!(size_of::<Vec3<R>>() == 3 * size_of::<R>() && align_of::<Vec3<R>>() == align_of::<R>()) };

    // SAFETY: nalgebra stores a 3-vector as an array of three numbers and nothing else.
    unsafe { std::slice::from_raw_parts(v.as_ptr().cast::<R>(), v.len() * 3) }
}

/// The same, to be written.
#[inline(always)]
#[allow(unsafe_code, reason = "a 3-vector is laid out as an array of three numbers")]
fn flat_mut<R: Real>(v: &mut [Vec3<R>]) -> &mut [R] {
    const { assert!(size_of::<Vec3<R>>() == 3 * size_of::<R>() && align_of::<Vec3<R>>() == align_of::<R>()) };

    // SAFETY: nalgebra stores a 3-vector as an array of three numbers and nothing else.
    unsafe { std::slice::from_raw_parts_mut(v.as_mut_ptr().cast::<R>(), v.len() * 3) }
}

/// y = s y + t x over one block.
#[inline]
pub(crate) fn combine<R: Real>(y: &mut [Vec3<R>], s: R, x: &[Vec3<R>], t: R) {
    dispatch(Combine { y: flat_mut(y), s, x: flat(x), t });
}

struct Combine<'a, R> {
    y: &'a mut [R],
    s: R,
    x: &'a [R],
    t: R,
}

impl<R: Real> WithSimd<R> for Combine<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let (s, t) = (P::splat(self.s), P::splat(self.t));
        let (packs, rest) = self.y.as_chunks_mut::<LANES>();
        let (others, rest_x) = self.x.as_chunks::<LANES>();
        for (y, x) in packs.iter_mut().zip(others) {
            *y = (s * P::load(y) + t * P::load(x)).store();
        }

        for (y, x) in rest.iter_mut().zip(rest_x) {
            *y = self.s * *y + self.t * *x;
        }
    }
}

/// Sums over one block of a and b: a.b, and the sum of `|a_c b_c|` over components, the scale of
/// the rounding error of the first.
#[inline]
pub(crate) fn block_sums<R: Real>(a: &[Vec3<R>], b: &[Vec3<R>]) -> [f64; 2] {
    dispatch(BlockSums { a: flat(a), b: flat(b) })
}

struct BlockSums<'a, R> {
    a: &'a [R],
    b: &'a [R],
}

impl<R: Real> WithSimd<R> for BlockSums<'_, R> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> [f64; 2] {
        let zero = P::Wide::zero();
        let (mut signed, mut magnitude) = (zero, zero);
        let (a, b) = (self.a.as_chunks::<LANES>(), self.b.as_chunks::<LANES>());

        let mut tails = [[R::zero(); LANES]; 2];
        tails[0][..a.1.len()].copy_from_slice(a.1);
        tails[1][..b.1.len()].copy_from_slice(b.1);

        for (a, b) in a.0.iter().zip(b.0).chain([(&tails[0], &tails[1])]) {
            let product = P::load(a).widen() * P::load(b).widen();
            signed += product;
            magnitude += product.abs();
        }

        [add_lanes(signed.store()), add_lanes(magnitude.store())]
    }
}
