//! Packs: sixteen numbers that are worked on together, whatever the width of the registers.

use super::super::{Real, Vec3};

/// Lanes of a pack, on any processor.
pub(crate) const LANES: usize = 16;

/// A vector with a fourth component that means nothing, so that it is loaded at once.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(16))]
pub struct Padded<R>(pub(crate) [R; 4]);

impl<R: Real> Padded<R> {
    #[inline(always)]
    /// The vector, padded.
    pub fn new(v: &Vec3<R>) -> Self {
        Self([v.x, v.y, v.z, R::zero()])
    }

    #[inline(always)]
    /// The vector.
    pub fn vector(&self) -> Vec3<R> {
        Vec3::new(self.0[0], self.0[1], self.0[2])
    }
}

/// Sixteen numbers; every operation is that of IEEE 754 in each lane.
///
/// Only [`super::dispatch`] chooses an implementation, after it has found its instructions on the
/// processor: that is what makes calling the methods sound.
pub(crate) trait Pack<R: Copy>: Copy + Send + Sync {
    /// The same lanes in binary64.
    type Wide: Pack<f64>;

    fn splat(value: R) -> Self;
    fn load(values: &[R; LANES]) -> Self;
    fn store(self) -> [R; LANES];
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn sqrt(self) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
    /// The greater of two; the other where one is NaN or both are zero.
    fn max(self, other: Self) -> Self;
    /// 1 / x where x > 0, else 0.
    fn inverse_or_zero(self) -> Self;
    /// The lane where `gate` > 0, else 0.
    fn where_positive(self, gate: Self) -> Self;
    fn widen(self) -> Self::Wide;
    /// The three components of sixteen vectors of a field.
    ///
    /// # Safety
    /// Every index is below `field.len()`.
    #[allow(unsafe_code, reason = "indices are checked once, when a model is built")]
    unsafe fn gather(field: &[Padded<R>], indices: &[u32; LANES]) -> [Self; 3];

    fn div(self, other: Self) -> Self;
    /// The lesser of two; the other where one is NaN or both are zero.
    fn min(self, other: Self) -> Self;
    /// The greatest whole number that is not greater.
    fn floor(self) -> Self;
    /// Lanes of `then` where self < `other`, else those of `otherwise`.
    fn if_less(self, other: Self, then: Self, otherwise: Self) -> Self;
    /// The magnitude of self with the sign of `other`.
    fn with_sign_of(self, other: Self) -> Self;
    /// 2^n where self is [`Rounding::MAGIC`] + n, for normal results.
    fn power_of_two(self) -> Self;
    /// Whole numbers from 0 to 65535.
    fn whole(self) -> [u16; LANES];

    /// Four numbers, four times: lane 4 g + c holds `quad[c]`.
    fn repeat(quad: &[R; 4]) -> Self;
    /// Each of four numbers four times: lane 4 g + c holds `quad[g]`.
    fn spread(quad: &[R; 4]) -> Self;
    /// Sums over the quads: (q0 + q2) + (q1 + q3).
    fn fold(self) -> [R; 4];
    /// Four packs from sixteen quads: lane l of pack c holds `quads[l][c]`.
    fn columns(quads: &[[R; 4]; LANES]) -> [Self; 4];
    /// Sixteen quads from four packs.
    fn rows(columns: [Self; 4]) -> [[R; 4]; LANES];
}

/// What rounding to whole numbers by addition needs.
pub(crate) trait Rounding: Copy {
    /// 1.5 * 2^(bits of the significand): a number of moderate size added to it is rounded to a
    /// whole one, which stands in the lowest bits.
    const MAGIC: Self;
    /// 2^n of MAGIC + n.
    fn power_of_two(self) -> Self;
}

impl Rounding for f32 {
    const MAGIC: Self = 12_582_912.0;
    #[inline(always)]
    fn power_of_two(self) -> Self {
        Self::from_bits((self.to_bits() << 23).wrapping_add(1.0_f32.to_bits()))
    }
}

impl Rounding for f64 {
    const MAGIC: Self = 6_755_399_441_055_744.0;
    #[inline(always)]
    fn power_of_two(self) -> Self {
        Self::from_bits((self.to_bits() << 52).wrapping_add(1.0_f64.to_bits()))
    }
}

/// Packs in the target's baseline instructions.
#[derive(Clone, Copy)]
pub(crate) struct Portable<R>([R; LANES]);

impl<R: Real> Portable<R> {
    #[inline(always)]
    fn map(self, f: impl Fn(R) -> R) -> Self {
        let mut lanes = self.0;
        for lane in &mut lanes {
            *lane = f(*lane);
        }
        Self(lanes)
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(R, R) -> R) -> Self {
        let mut lanes = self.0;
        for lane in 0..LANES {
            lanes[lane] = f(lanes[lane], other.0[lane]);
        }
        Self(lanes)
    }
}

impl<R: Real> Pack<R> for Portable<R> {
    type Wide = Portable<f64>;

    #[inline(always)]
    fn splat(value: R) -> Self {
        Self([value; LANES])
    }
    #[inline(always)]
    fn load(values: &[R; LANES]) -> Self {
        Self(*values)
    }
    #[inline(always)]
    fn store(self) -> [R; LANES] {
        self.0
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(R::sqrt)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.map(|x| if x > R::zero() { x } else { R::zero() - x })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // As the processors' instruction: the second where the first is not greater.
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn inverse_or_zero(self) -> Self {
        self.map(|x| if x > R::zero() { R::one() / x } else { R::zero() })
    }
    #[inline(always)]
    fn where_positive(self, gate: Self) -> Self {
        self.zip(gate, |x, gate| if gate > R::zero() { x } else { R::zero() })
    }
    #[inline(always)]
    fn widen(self) -> Portable<f64> {
        Portable(self.0.map(R::to_f64))
    }
    #[inline(always)]
    #[allow(unsafe_code, reason = "indices are checked once, when a model is built")]
    unsafe fn gather(field: &[Padded<R>], indices: &[u32; LANES]) -> [Self; 3] {
        let mut lanes = [[R::zero(); LANES]; 3];
        for lane in 0..LANES {
            // SAFETY: the caller promises that the index is in range.
            let v = unsafe { field.get_unchecked(indices[lane] as usize) };
            for c in 0..3 {
                lanes[c][lane] = v.0[c];
            }
        }
        lanes.map(Self)
    }

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn floor(self) -> Self {
        self.map(R::floor)
    }
    #[inline(always)]
    fn if_less(self, other: Self, then: Self, otherwise: Self) -> Self {
        let mut lanes = otherwise.0;
        for lane in 0..LANES {
            if self.0[lane] < other.0[lane] {
                lanes[lane] = then.0[lane];
            }
        }
        Self(lanes)
    }
    #[inline(always)]
    fn with_sign_of(self, other: Self) -> Self {
        self.zip(other, R::copysign)
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        self.map(R::power_of_two)
    }
    #[inline(always)]
    fn whole(self) -> [u16; LANES] {
        let mut whole = [0; LANES];
        for lane in 0..LANES {
            whole[lane] = self.0[lane].to_f64() as u16;
        }
        whole
    }
    #[inline(always)]
    fn repeat(quad: &[R; 4]) -> Self {
        let mut lanes = [quad[0]; LANES];
        for lane in 0..LANES {
            lanes[lane] = quad[lane % 4];
        }
        Self(lanes)
    }
    #[inline(always)]
    fn spread(quad: &[R; 4]) -> Self {
        let mut lanes = [quad[0]; LANES];
        for lane in 0..LANES {
            lanes[lane] = quad[lane / 4];
        }
        Self(lanes)
    }
    #[inline(always)]
    fn fold(self) -> [R; 4] {
        let mut sums = [R::zero(); 4];
        for c in 0..4 {
            sums[c] = (self.0[c] + self.0[c + 8]) + (self.0[c + 4] + self.0[c + 12]);
        }
        sums
    }
    #[inline(always)]
    fn columns(quads: &[[R; 4]; LANES]) -> [Self; 4] {
        let mut columns = [[R::zero(); LANES]; 4];
        for lane in 0..LANES {
            for c in 0..4 {
                columns[c][lane] = quads[lane][c];
            }
        }
        columns.map(Self)
    }
    #[inline(always)]
    fn rows(columns: [Self; 4]) -> [[R; 4]; LANES] {
        let mut quads = [[R::zero(); 4]; LANES];
        for lane in 0..LANES {
            for c in 0..4 {
                quads[lane][c] = columns[c].0[lane];
            }
        }
        quads
    }
}

/// Quads of a pack by way of memory: binary64 is for accuracy.
macro_rules! quads_by_lanes {
    ($number:ty) => {
        #[inline(always)]
        fn repeat(quad: &[$number; 4]) -> Self {
            Self::load(&Portable::repeat(quad).store())
        }
        #[inline(always)]
        fn spread(quad: &[$number; 4]) -> Self {
            Self::load(&Portable::spread(quad).store())
        }
        #[inline(always)]
        fn fold(self) -> [$number; 4] {
            Portable::load(&self.store()).fold()
        }
        #[inline(always)]
        fn columns(quads: &[[$number; 4]; LANES]) -> [Self; 4] {
            let [a, b, c, d] = Portable::columns(quads);
            [Self::load(&a.store()), Self::load(&b.store()), Self::load(&c.store()), Self::load(&d.store())]
        }
        #[inline(always)]
        fn rows(columns: [Self; 4]) -> [[$number; 4]; LANES] {
            let [a, b, c, d] = columns;
            Portable::rows([
                Portable::load(&a.store()),
                Portable::load(&b.store()),
                Portable::load(&c.store()),
                Portable::load(&d.store()),
            ])
        }
    };
}
#[cfg(target_arch = "x86_64")]
pub(super) use quads_by_lanes;
