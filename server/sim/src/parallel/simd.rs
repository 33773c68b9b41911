//! The widest vector instructions of the processor, chosen at run time.
//!
//! A kernel is plain Rust over lanes of fixed number; it is compiled once for each level. Rust
//! neither fuses nor reorders floating-point operations, so every level gives the same bits.
#![allow(unsafe_code, reason = "calls functions compiled for instructions that were found at run time")]

use std::sync::atomic::{AtomicU8, Ordering};

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

/// Work to be compiled for each level. Mark `run` and all that it calls `#[inline(always)]`.
pub trait Kernel {
    /// What it returns.
    type Output;
    /// Does the work.
    fn run(self) -> Self::Output;
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
        && std::arch::is_x86_feature_detected!("avx512bw")
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
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    match simd_level() {
        // SAFETY: a level is in use only if `detect` found its instructions on this processor.
        SimdLevel::Avx512 => return unsafe { run_avx512(kernel) },
        // SAFETY: as above.
        SimdLevel::Avx2 => return unsafe { run_avx2(kernel) },
        SimdLevel::Portable => {}
    }
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl")]
fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}
