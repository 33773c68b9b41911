//! Sums over one block: products and their magnitudes, in binary64, in a fixed order of lanes.

use crate::{
    math::{Real, Vec3},
    parallel::{Kernel, dispatch},
};

/// Lanes of a sum: component c of a block goes to lane c mod 8, whatever the processor.
const LANES: usize = 8;

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

impl<R: Real> Kernel for BlockSums<'_, R> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run(self) -> [f64; 2] {
        let (mut signed, mut magnitude) = ([0.0; LANES], [0.0; LANES]);
        let (a, b) = (self.a.chunks_exact(LANES), self.b.chunks_exact(LANES));
        let (rest_a, rest_b) = (a.remainder(), b.remainder());
        for (a, b) in a.zip(b) {
            for lane in 0..LANES {
                let product = a[lane].to_f64() * b[lane].to_f64();
                signed[lane] += product;
                magnitude[lane] += product.abs();
            }
        }
        for (lane, (a, b)) in rest_a.iter().zip(rest_b).enumerate() {
            let product = a.to_f64() * b.to_f64();
            signed[lane] += product;
            magnitude[lane] += product.abs();
        }
        [signed, magnitude].map(|s| ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7])))
    }
}
