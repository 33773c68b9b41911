//! Precision of a state, chosen per session at run time; sums are binary64 whatever it is.

use std::fmt;

use super::simd::Rounding;
#[cfg(target_arch = "x86_64")]
use super::simd::{Pack, avx2, avx512};

/// How positions and velocities are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Precision {
    /// IEEE binary32.
    F32,
    /// IEEE binary64.
    F64,
}

impl Precision {
    /// Both.
    pub const ALL: [Self; 2] = [Self::F32, Self::F64];

    /// `f32` or `f64`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }

    /// The precision of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|precision| precision.name() == name)
    }
}

impl fmt::Display for Precision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Packs of a number at each level. Not visible outside, which also seals [`Real`].
pub(crate) trait Packed: Copy {
    #[cfg(target_arch = "x86_64")]
    type Avx2: Pack<Self>;
    #[cfg(target_arch = "x86_64")]
    type Avx512: Pack<Self>;
}

impl Packed for f32 {
    #[cfg(target_arch = "x86_64")]
    type Avx2 = avx2::F32x16;
    #[cfg(target_arch = "x86_64")]
    type Avx512 = avx512::F32x16;
}

impl Packed for f64 {
    #[cfg(target_arch = "x86_64")]
    type Avx2 = avx2::F64x16;
    #[cfg(target_arch = "x86_64")]
    type Avx512 = avx512::F64x16;
}

/// A floating-point number that a state is made of: `f32` or `f64`, and no other.
#[allow(private_bounds, reason = "packs are for the kernels of this crate")]
pub trait Real: Packed + Rounding + nalgebra::RealField + Copy + Default + PartialOrd + 'static {
    /// Which of the two it is.
    const PRECISION: Precision;
    /// Unit round-off: half the distance from 1 to the next number.
    const ROUNDING: f64;
    /// Below this a length is none: its fourth power would leave the range of normal numbers.
    const SMALLEST: f64;
    /// The largest finite number.
    const LARGEST: f64;
    /// Rounds a binary64 number.
    fn of(value: f64) -> Self;
    /// Widens exactly to binary64.
    fn to_f64(self) -> f64;
}

impl Real for f32 {
    const PRECISION: Precision = Precision::F32;
    const ROUNDING: f64 = Self::EPSILON as f64 / 2.0;
    const SMALLEST: f64 = 1e-9;
    const LARGEST: f64 = Self::MAX as f64;
    #[inline(always)]
    fn of(value: f64) -> Self {
        value as Self
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    const PRECISION: Precision = Precision::F64;
    const ROUNDING: f64 = Self::EPSILON / 2.0;
    const SMALLEST: f64 = 1e-75;
    const LARGEST: f64 = Self::MAX;
    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
}
