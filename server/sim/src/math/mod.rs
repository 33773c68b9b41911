//! Numbers and small vectors: numbers as text, the precision of a state, 3-vectors over it, packs of lanes.

mod number;
mod vector;
mod precision;
mod real;
pub(crate) mod bytes;
pub mod array;
mod simd;
mod svd;
mod exp;

pub use number::{four_digits, number};
pub use precision::Precision;
pub use real::{Padded, Real, Sixteen};
pub use simd::{MissingInstructions, SimdLevel, check_processor, force_simd_level, simd_level};
pub use vector::{Mat3, Vec3};

pub(crate) use array::three;
pub(crate) use bytes::Bytes;
pub(crate) use exp::exp;
pub(crate) use real::{LANES, Lanes, Pack, Record, Register};
pub(crate) use simd::{Portable, WithSimd, dispatch, prefetch};
pub(crate) use svd::{Columns, Svd, cross3, dot3, orthogonalize, svd};

/// Converts a vector of a scene (binary64) to the state's precision.
pub fn vec3<R: Real>(v: [f64; 3]) -> Vec3<R> {
    Vec3::new(R::of(v[0]), R::of(v[1]), R::of(v[2]))
}

/// Converts a vector of the state to binary64.
pub fn array3<R: Real>(v: &Vec3<R>) -> [f64; 3] {
    [v.x.to_f64(), v.y.to_f64(), v.z.to_f64()]
}
