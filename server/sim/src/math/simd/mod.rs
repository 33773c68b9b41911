//! The widest vector instructions of the processor, chosen at run time.
//!
//! A kernel works on packs of sixteen lanes and is compiled once for each level. A pack's
//! operations are those of IEEE 754, lane by lane, never fused nor reordered, so that every level
//! gives the same bits.
#![allow(unsafe_code, reason = "calls functions compiled for instructions that were found at run time")]

mod operators;
mod portable;
#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;

pub(crate) use portable::Portable;

use std::sync::atomic::{AtomicU8, Ordering};

use super::real::{Pack, Packed, Real};

/// Instructions that kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SimdLevel {
    /// The target's baseline.
    Portable = 1,
    /// 256-bit vectors of x86-64.
    Avx2 = 2,
    /// 512-bit vectors of x86-64.
    Avx512 = 3,
}

impl SimdLevel {
    /// Every level, the narrowest first.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];
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

/// Work to be compiled for each level. Mark `run` and all that it calls `#[inline(always)]`.
pub(crate) trait WithSimd<R: Real> {
    /// What it returns.
    type Output;
    /// Whether binary64 is worth instructions of 512 bits: each level is compiled for itself.
    const WIDE_BINARY64: bool = true;
    /// Does the work with packs of type `P`.
    fn run<P: Pack<Number = R>>(self) -> Self::Output;
}

/// 0: not known yet.
static LEVEL: AtomicU8 = AtomicU8::new(0);

/// The level in use.
pub fn simd_level() -> SimdLevel {
    match LEVEL.load(Ordering::Relaxed) {
        1 => SimdLevel::Portable,
        2 => SimdLevel::Avx2,
        3 => SimdLevel::Avx512,
        _ => {
            let found = detect();
            LEVEL.store(found as u8, Ordering::Relaxed);
            found
        }
    }
}

/// Uses `level`, or the best that the processor has below it: for tests and comparisons.
/// Returns the level in use. Results have the same bits at every level.
pub fn force_simd_level(level: SimdLevel) -> SimdLevel {
    let used = level.min(detect());
    LEVEL.store(used as u8, Ordering::Relaxed);
    used
}

#[cfg(target_arch = "x86_64")]
fn detect() -> SimdLevel {
    let wide = std::arch::is_x86_feature_detected!("avx512f")
        && std::arch::is_x86_feature_detected!("avx512dq")
        && std::arch::is_x86_feature_detected!("avx512vl");
    match (std::arch::is_x86_feature_detected!("avx2"), wide) {
        (true, true) => SimdLevel::Avx512,
        (true, false) => SimdLevel::Avx2,
        _ => SimdLevel::Portable,
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn detect() -> SimdLevel {
    SimdLevel::Portable
}

/// Runs a kernel with the instructions of [`simd_level`].
#[inline]
pub(crate) fn dispatch<R: Real, K: WithSimd<R>>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    match simd_level() {
        // A level is in use only if `detect` found its instructions, and AVX2 with them.
        SimdLevel::Avx512 => {
            if R::PRECISION as u8 == super::real::Precision::F32 as u8 || K::WIDE_BINARY64 {
                // SAFETY: as said above.
                return unsafe { run_avx512(kernel) };
            }
            // SAFETY: as said above.
            return unsafe { run_avx2(kernel) };
        }
        // SAFETY: as above.
        SimdLevel::Avx2 => return unsafe { run_avx2(kernel) },
        SimdLevel::Portable => {}
    }
    kernel.run::<Portable<R>>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,avx512f,avx512dq,avx512vl")]
fn run_avx512<R: Real, K: WithSimd<R>>(kernel: K) -> K::Output {
    kernel.run::<R::Avx512>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<R: Real, K: WithSimd<R>>(kernel: K) -> K::Output {
    kernel.run::<R::Avx2>()
}
