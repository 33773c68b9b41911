//! Sums over one block: products and their magnitudes, in binary64, in a fixed order of lanes.

use crate::math::{Kernel, LANES, Pack, Real, Vec3, dispatch};

/// The components of vectors, x y z after one another.
#[inline(always)]
fn flat<R: Real>(v: &[Vec3<R>]) -> &[R] {
    // Three components a vector, in order: nalgebra's storage of a 3-vector is an array.
    nalgebra_flat(v)
}

#[inline(always)]
#[allow(unsafe_code, reason = "a 3-vector is laid out as an array of three numbers")]
fn nalgebra_flat<R: Real>(v: &[Vec3<R>]) -> &[R] {
    const { assert!(size_of::<Vec3<f32>>() == 12 && size_of::<Vec3<f64>>() == 24) };
    // SAFETY: `Vector3<R>` is a transparent wrapper of `[[R; 3]; 1]` with the alignment of `R`.
    unsafe { std::slice::from_raw_parts(v.as_ptr().cast::<R>(), v.len() * 3) }
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

impl<R: Real> Kernel<R> for BlockSums<'_, R> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run<P: Pack<R>>(self) -> [f64; 2] {
        let zero = <P::Wide as Pack<f64>>::splat(0.0);
        let (mut signed, mut magnitude) = (zero, zero);
        let (a, b) = (self.a.as_chunks::<LANES>(), self.b.as_chunks::<LANES>());
        let mut tails = [[R::zero(); LANES]; 2];
        tails[0][..a.1.len()].copy_from_slice(a.1);
        tails[1][..b.1.len()].copy_from_slice(b.1);
        for (a, b) in a.0.iter().zip(b.0).chain([(&tails[0], &tails[1])]) {
            let product = P::load(a).widen().mul(P::load(b).widen());
            signed = signed.add(product);
            magnitude = magnitude.add(product.abs());
        }
        [signed, magnitude].map(|sum| add_lanes(sum.store()))
    }
}

/// Adds lanes in pairs.
#[inline(always)]
fn add_lanes(lanes: [f64; LANES]) -> f64 {
    let eight: [f64; 8] = std::array::from_fn(|i| lanes[i] + lanes[i + 8]);
    let four: [f64; 4] = std::array::from_fn(|i| eight[i] + eight[i + 4]);
    (four[0] + four[2]) + (four[1] + four[3])
}
