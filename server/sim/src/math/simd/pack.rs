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
}
