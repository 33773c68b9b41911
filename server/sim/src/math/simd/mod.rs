//! The widest vector instructions of the processor, chosen at run time.
//!
//! A kernel works on packs of sixteen lanes and is compiled once for each level. A pack's
//! operations are those of IEEE 754, lane by lane, never fused nor reordered, so that every level
//! gives the same bits.
#![allow(unsafe_code, reason = "calls functions compiled for instructions that were found at run time")]

mod operators;
mod portable;
#[cfg(target_arch = "x86_64")]
mod register;
#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;

pub(crate) use portable::Portable;

use std::sync::atomic::{AtomicU8, Ordering};

use super::{
    precision::Precision,
    real::{Pack, Packed, Real},
};

/// Instructions that kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SimdLevel {
    /// The target's baseline. On x86-64 with the feature `portable` alone, for comparisons.
    Portable = 1,
    /// 256-bit vectors of x86-64.
    Avx2 = 2,
    /// 512-bit vectors of x86-64.
    Avx512 = 3,
}

impl SimdLevel {
    /// Every level that this build has kernels for, the narrowest first.
    pub const ALL: &[Self] = if !cfg!(target_arch = "x86_64") {
        &[Self::Portable]
    } else if cfg!(feature = "portable") {
        &[Self::Portable, Self::Avx2, Self::Avx512]
    } else {
        &[Self::Avx2, Self::Avx512]
    };
}

/// Whether kernels are compiled for 512 bits: without, a build that runs only once is sooner done.
#[cfg(target_arch = "x86_64")]
const WIDE: bool = true;

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

    /// Does the work with instructions of 512 bits. A method, and no function, so that the compiler keeps it with the
    /// kernel's own module: all kernels together would be one unit of code, which one core compiles.
    ///
    /// # Safety
    /// The processor has these instructions.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,avx512f,avx512dq,avx512vl")]
    unsafe fn run_avx512(self) -> Self::Output
    where
        Self: Sized,
    {
        self.run::<R::Avx512>()
    }

    /// Does the work with instructions of 256 bits.
    ///
    /// # Safety
    /// The processor has these instructions.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    unsafe fn run_avx2(self) -> Self::Output
    where
        Self: Sized,
    {
        self.run::<R::Avx2>()
    }
}

/// 0: not known yet.
static LEVEL: AtomicU8 = AtomicU8::new(0);

/// This processor lacks instructions that every kernel is compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "this processor has no AVX2, which nappe needs on x86-64: Intel Core since 2013 and AMD since 2015 have it"
)]
pub struct MissingInstructions;

/// Whether this build has kernels for this processor. A program asks before it computes.
///
/// # Errors
/// When it has none.
pub fn check_processor() -> Result<(), MissingInstructions> {
    detect().map(|_| ()).ok_or(MissingInstructions)
}

/// The level in use.
///
/// # Panics
/// When this build has no kernels for this processor.
pub fn simd_level() -> SimdLevel {
    match LEVEL.load(Ordering::Relaxed) {
        1 => SimdLevel::Portable,
        2 => SimdLevel::Avx2,
        3 => SimdLevel::Avx512,
        _ => {
            let found = best();
            LEVEL.store(found as u8, Ordering::Relaxed);
            found
        }
    }
}

/// Uses `level`, or the best that the processor has below it: for tests and comparisons.
/// Returns the level in use. Results have the same bits at every level.
///
/// # Panics
/// When this build has no kernels for `level`, or none for this processor.
pub fn force_simd_level(level: SimdLevel) -> SimdLevel {
    assert!(SimdLevel::ALL.contains(&level), "this build has no kernels for {level:?}");
    let used = level.min(best());
    LEVEL.store(used as u8, Ordering::Relaxed);
    used
}

/// The widest level of the processor.
fn best() -> SimdLevel {
    detect().unwrap_or_else(|| panic!("{MissingInstructions}"))
}

/// The widest level of the processor; none where no kernel can run.
#[cfg(target_arch = "x86_64")]
fn detect() -> Option<SimdLevel> {
    let wide = std::arch::is_x86_feature_detected!("avx512f")
        && std::arch::is_x86_feature_detected!("avx512dq")
        && std::arch::is_x86_feature_detected!("avx512vl");
    match (std::arch::is_x86_feature_detected!("avx2"), wide) {
        (true, true) => Some(SimdLevel::Avx512),
        (true, false) => Some(SimdLevel::Avx2),
        _ if cfg!(feature = "portable") => Some(SimdLevel::Portable),
        _ => None,
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn detect() -> Option<SimdLevel> {
    Some(SimdLevel::Portable)
}

/// Asks for the memory of an item, so that it has come when it is read. The index may be beyond the items. It changes no
/// result.
#[inline(always)]
pub(crate) fn prefetch<T>(items: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every processor of x86-64 has the instruction, and no address is wrong for it.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(items.as_ptr().wrapping_add(index).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (items, index);
}

/// Runs a kernel with the instructions of [`simd_level`]. What no level needs is left out by constants, before code
/// is generated.
#[cfg(target_arch = "x86_64")]
#[inline]
pub(crate) fn dispatch<R: Real, K: WithSimd<R>>(kernel: K) -> K::Output {
    let level = simd_level();
    #[cfg(feature = "portable")]
    if level == SimdLevel::Portable {
        return kernel.run::<Portable<R>>();
    }
    if const { WIDE && (matches!(R::PRECISION, Precision::F32) || K::WIDE_BINARY64) }
        && level == SimdLevel::Avx512
    {
        // SAFETY: a level is in use only if `detect` found its instructions, and AVX2 with them.
        return unsafe { kernel.run_avx512() };
    }
    // SAFETY: as above; the narrowest level that is left.
    unsafe { kernel.run_avx2() }
}

/// Runs a kernel with the target's baseline instructions.
#[cfg(not(target_arch = "x86_64"))]
#[inline]
pub(crate) fn dispatch<R: Real, K: WithSimd<R>>(kernel: K) -> K::Output {
    kernel.run::<Portable<R>>()
}

#[cfg(test)]
mod tests {
    use std::marker::PhantomData;

    use super::{
        super::real::{LANES, Lanes, Pack, Padded, Real, Record, Register, Rounding as _},
        *,
    };

    /// Compares a level's packs with arrays.
    struct Compare<R>(PhantomData<R>);

    impl<R: Real> WithSimd<R> for Compare<R> {
        type Output = ();

        #[inline(always)]
        fn run<P: Pack<Number = R>>(self) {
            let numbers = [
                0.0,
                -0.0,
                1.0,
                -1.0,
                0.5,
                -2.5,
                3.75,
                1e-30,
                -1e30,
                f64::INFINITY,
                f64::NEG_INFINITY,
                1e-42,
                7.0,
                -7.5,
                1e9,
                65535.0,
            ];
            let x = numbers.map(R::of);
            for shift in 0..LANES {
                let mut y = x;
                y.rotate_left(shift);
                assert_eq!(of_two::<P>(&x, &y), of_two::<Portable<R>>(&x, &y), "rotated by {shift}");
                assert_eq!(
                    of_registers::<P>(&x, &y),
                    of_registers::<Portable<R>>(&x, &y),
                    "rotated by {shift}"
                );
            }
            assert_eq!(of_one::<P>(&x), of_one::<Portable<R>>(&x));
            assert_eq!(of_quads::<P>(&x), of_quads::<Portable<R>>(&x));
        }
    }

    /// The bits of lanes; all that are no numbers are alike.
    #[inline(always)]
    fn bits<P: Pack>(pack: P) -> [u64; LANES] {
        pack.store().map(P::Number::to_f64).map(|x| if x.is_nan() { u64::MAX } else { x.to_bits() })
    }

    #[inline(always)]
    fn of_two<P: Pack>(x: &[P::Number; LANES], y: &[P::Number; LANES]) -> Vec<[u64; LANES]> {
        let (x, y) = (P::load(x), P::load(y));
        let (one, two) = (P::one(), P::of(2.0));
        [
            x + y,
            x - y,
            x * y,
            x / y,
            -x,
            x.max(y),
            x.min(y),
            x.where_positive(y),
            x.if_less(y, one, two),
            x.with_sign_of(y),
        ]
        .map(bits)
        .to_vec()
    }

    /// What registers of x and y give, register by register.
    #[inline(always)]
    fn of_registers<P: Pack>(x: &[P::Number; LANES], y: &[P::Number; LANES]) -> Vec<[u64; LANES]> {
        let (mut lanes, mut again) = ([[P::Number::default(); LANES]; 4], P::zero());
        let (zero, one) = (P::Register::zero(), P::Register::one());
        assert_eq!((one.any(), zero.any()), (true, false));
        for part in 0..P::Register::PARTS {
            let (a, b) = (P::load(x).register(part), P::Register::load_part(y, part));
            again.set_register(part, a);
            a.sqrt().store_part(&mut lanes[0], part);
            a.abs().store_part(&mut lanes[1], part);
            a.if_less(b, one, a).store_part(&mut lanes[2], part);
            a.with_sign_of(b).store_part(&mut lanes[3], part);
        }
        lanes.map(|lanes| bits(P::load(&lanes))).into_iter().chain([bits(again)]).collect()
    }

    #[inline(always)]
    fn of_one<P: Pack>(x: &[P::Number; LANES]) -> (Vec<[u64; LANES]>, [u64; LANES], [u16; LANES]) {
        let counts: [f64; LANES] = std::array::from_fn(|i| i as f64);
        let power = P::load(&counts.map(|n| P::Number::of(P::Number::MAGIC.to_f64() + n)));
        let whole = P::load(&counts.map(|n| P::Number::of(4369.0 * n))).whole();
        let x = P::load(x);
        let same = [
            x.sqrt(),
            x.abs(),
            x.inverse_or_zero(),
            x.inverse_above(P::one()),
            x.floor(),
            power.power_of_two(),
        ];
        let singles = P::from_singles(&x.to_singles());
        let packs = same.into_iter().chain([singles]).map(bits).collect();
        (packs, bits(x.widen()), whole)
    }

    #[inline(always)]
    fn of_quads<P: Pack>(x: &[P::Number; LANES]) -> Vec<[u64; LANES]> {
        let quads: [[P::Number; 4]; LANES] =
            std::array::from_fn(|i| std::array::from_fn(|c| P::Number::of((4 * i + c) as f64)));
        let records: [_; LANES] =
            std::array::from_fn(|i| Record([Padded(quads[i]), Padded(quads[LANES - 1 - i])]));
        let indices = std::array::from_fn(|i| (7 * i % LANES) as u16);
        // SAFETY: indices below sixteen.
        let gathered = unsafe { P::gather(&records, &indices) };
        let columns = P::columns(&quads);
        assert_eq!(P::rows(columns), quads);
        assert_eq!((columns[0].any(), P::zero().any()), (true, false));

        let fold = std::array::from_fn(|i| P::load(x).max(P::zero()).fold()[i % 4].to_f64().to_bits());
        let packs =
            gathered.into_iter().flatten().chain(columns).chain([P::repeat(&quads[3]), P::spread(&quads[3])]);
        packs.map(bits).chain([fold]).collect()
    }

    fn at_every_level<R: Real>() {
        let compare = || Compare::<R>(PhantomData);
        compare().run::<Portable<R>>();
        #[cfg(target_arch = "x86_64")]
        {
            if best() >= SimdLevel::Avx2 {
                // SAFETY: its instructions were found.
                unsafe { compare().run_avx2() };
            }
            if best() >= SimdLevel::Avx512 {
                // SAFETY: its instructions were found.
                unsafe { compare().run_avx512() };
            }
        }
    }

    #[test]
    fn every_operation_of_a_pack_gives_the_bits_of_arrays() {
        at_every_level::<f32>();
        at_every_level::<f64>();
    }
}
