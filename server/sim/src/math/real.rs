//! Numbers that a state is made of, one at a time and sixteen at a time.
//!
//! The precision is chosen per session at run time; sums are binary64 whatever it is. The two kinds
//! of number stand in one file since each names the other.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use bytemuck::Zeroable;

use super::{precision::Precision, vector::Vec3};

/// Packs of a number at each level of x86-64. Not visible outside, which also seals [`Real`].
pub(crate) trait Packed: Copy {
    #[cfg(target_arch = "x86_64")]
    type Avx2: Pack<Number = Self>;
    #[cfg(target_arch = "x86_64")]
    type Avx512: Pack<Number = Self>;
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

/// A floating-point number that a state is made of: `f32` or `f64`, and no other.
#[allow(private_bounds, reason = "packs are for the kernels of this crate")]
pub trait Real:
    Packed + Rounding + nalgebra::RealField + Zeroable + Copy + Default + PartialOrd + 'static
{
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
    /// Bytes of a number.
    const BYTES: usize;
    /// Writes its bytes, the lowest first, to as many.
    fn write(self, bytes: &mut [u8]);
    /// The number of as many bytes.
    fn read(bytes: &[u8]) -> Self;
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
    const BYTES: usize = 4;
    #[inline(always)]
    fn write(self, bytes: &mut [u8]) {
        bytes.copy_from_slice(&self.to_le_bytes());
    }
    #[inline(always)]
    fn read(bytes: &[u8]) -> Self {
        Self::from_le_bytes(*bytes.first_chunk().expect("the bytes of a number"))
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
    const BYTES: usize = 8;
    #[inline(always)]
    fn write(self, bytes: &mut [u8]) {
        bytes.copy_from_slice(&self.to_le_bytes());
    }
    #[inline(always)]
    fn read(bytes: &[u8]) -> Self {
        Self::from_le_bytes(*bytes.first_chunk().expect("the bytes of a number"))
    }
}

/// Lanes of a pack, on any processor.
pub(crate) const LANES: usize = 16;

/// A vector with a fourth component that means nothing, so that it is loaded at once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Zeroable)]
#[repr(C, align(16))]
pub struct Padded<R>(pub(crate) [R; 4]);

impl<R: Real> Padded<R> {
    #[inline(always)]
    /// A vector with 0 as its fourth component.
    pub fn new(v: &Vec3<R>) -> Self {
        Self([v.x, v.y, v.z, R::zero()])
    }

    #[inline(always)]
    /// The three components that mean something.
    pub fn vector(&self) -> Vec3<R> {
        Vec3::new(self.0[0], self.0[1], self.0[2])
    }

    /// The same as plain numbers.
    #[inline(always)]
    #[allow(unsafe_code, reason = "a padded vector is laid out as four numbers")]
    pub(crate) fn quads(vectors: &[Self; LANES]) -> &[[R; 4]; LANES] {
        const { assert!(size_of::<Self>() == 4 * size_of::<R>()) };
        // SAFETY: a padded vector holds four numbers and nothing else, at a stricter alignment.
        unsafe { &*std::ptr::from_ref(vectors).cast() }
    }
}

/// Two vectors of a particle side by side, each with a fourth component that means nothing: what a kernel reads of a
/// neighbour at once.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub(crate) struct Record<R>(pub(crate) [Padded<R>; 2]);

/// Sixteen vectors, component by component: what a kernel reads of its own particles at once.
#[derive(Clone, Copy, Debug, PartialEq, Zeroable)]
#[repr(C, align(64))]
pub struct Sixteen<R>(pub [[R; LANES]; 3]);

impl<R: Real> Default for Sixteen<R> {
    fn default() -> Self {
        Self([[R::zero(); LANES]; 3])
    }
}

impl<R: Real> Sixteen<R> {
    /// Vectors in each.
    pub const LANES: usize = LANES;

    /// How many sixteens hold `count` vectors: the lanes of the last that are left over are 0.
    pub const fn count_for(count: usize) -> usize {
        count.div_ceil(LANES)
    }

    /// Vectors as sixteens.
    pub fn from_vectors(vectors: &[Vec3<R>]) -> Vec<Self> {
        let sixteen = |vectors: &[Vec3<R>]| {
            let mut lanes = Self::default();
            vectors.iter().enumerate().for_each(|(lane, vector)| lanes.set(lane, *vector));
            lanes
        };
        vectors.chunks(LANES).map(sixteen).collect()
    }

    /// The first `count` vectors of sixteens.
    pub fn to_vectors(sixteens: &[Self], count: usize) -> Vec<Vec3<R>> {
        (0..count).map(|i| sixteens[i / LANES].get(i % LANES)).collect()
    }

    /// The vector in a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Vec3<R> {
        Vec3::new(self.0[0][lane], self.0[1][lane], self.0[2][lane])
    }

    /// Writes the vector in a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, vector: Vec3<R>) {
        (self.0[0][lane], self.0[1][lane], self.0[2][lane]) = (vector.x, vector.y, vector.z);
    }

    #[inline(always)]
    pub(crate) fn load<P: Pack<Number = R>>(&self) -> [P; 3] {
        [P::load(&self.0[0]), P::load(&self.0[1]), P::load(&self.0[2])]
    }

    #[inline(always)]
    pub(crate) fn store<P: Pack<Number = R>>(&mut self, packs: [P; 3]) {
        (self.0[0], self.0[1], self.0[2]) = (packs[0].store(), packs[1].store(), packs[2].store());
    }
}

/// The four operations, on a pack's right another pack or one number for every lane.
pub(crate) trait Arithmetic<T>:
    Sized + Add<T, Output = Self> + Sub<T, Output = Self> + Mul<T, Output = Self> + Div<T, Output = Self>
{
}

impl<P, T> Arithmetic<T> for P where
    P: Add<T, Output = P> + Sub<T, Output = P> + Mul<T, Output = P> + Div<T, Output = P>
{
}

/// As many of sixteen lanes as a kernel works on at a time: all of them, or one register's, where a kernel keeps more
/// values than there are registers for all. Lanes never meet, so that both give the same bits.
pub(crate) trait Lanes:
    Arithmetic<Self> + Arithmetic<<Self as Lanes>::Number> + AddAssign + SubAssign + Copy + Send + Sync
{
    /// What a lane holds.
    type Number: Real;
    /// How many of them make sixteen lanes.
    const PARTS: usize;

    fn load_part(values: &[Self::Number; LANES], part: usize) -> Self;
    fn store_part(self, values: &mut [Self::Number; LANES], part: usize);
    /// The three components of both vectors of the records that are named in these lanes.
    ///
    /// # Safety
    /// Every index is below `records.len()`.
    #[allow(unsafe_code, reason = "indices are checked once, when a model is built")]
    unsafe fn gather_part(
        records: &[Record<Self::Number>],
        indices: &[u16; LANES],
        part: usize,
    ) -> [[Self; 3]; 2];
}

/// The lanes of one register, with what it takes to turn columns of matrices. Every operation is that of a [`Pack`].
pub(crate) trait Register: Lanes {
    fn splat(value: Self::Number) -> Self;
    /// 0 in every lane.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(Self::Number::default())
    }
    /// 1 in every lane.
    #[inline(always)]
    fn one() -> Self {
        Self::splat(Self::Number::of(1.0))
    }
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    fn if_less(self, other: Self, then: Self, otherwise: Self) -> Self;
    fn with_sign_of(self, other: Self) -> Self;
    fn any(self) -> bool;
}

/// Sixteen numbers; every operation is that of IEEE 754 in each lane, never fused. `-x` is 0 - x:
/// zeros become +0.
///
/// Only `dispatch` chooses an implementation, after it has found its instructions on the
/// processor: that is what makes calling the methods sound.
pub(crate) trait Pack: Lanes + Neg<Output = Self> {
    /// The lanes of one register.
    type Register: Register<Number = Self::Number>;
    /// The same lanes in binary64.
    type Wide: Pack<Number = f64>;

    fn splat(value: Self::Number) -> Self;
    fn load(values: &[Self::Number; LANES]) -> Self;
    fn store(self) -> [Self::Number; LANES];
    /// The lanes of its register `part`.
    fn register(self, part: usize) -> Self::Register;
    fn set_register(&mut self, part: usize, lanes: Self::Register);

    /// 0 in every lane.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(Self::Number::default())
    }
    /// 1 in every lane.
    #[inline(always)]
    fn one() -> Self {
        Self::splat(Self::Number::of(1.0))
    }
    /// A constant in every lane, rounded to the lane's precision.
    #[inline(always)]
    fn of(value: f64) -> Self {
        Self::splat(Self::Number::of(value))
    }

    fn sqrt(self) -> Self;
    /// |x| in each lane.
    fn abs(self) -> Self;
    /// The greater of two; the other where one is NaN or both are zero.
    fn max(self, other: Self) -> Self;
    /// 1 / x where x is greater than `least`, else 0.
    fn inverse_above(self, least: Self) -> Self;
    /// 1 / x where x > 0, else 0.
    #[inline(always)]
    fn inverse_or_zero(self) -> Self {
        self.inverse_above(Self::zero())
    }
    /// The lane where `gate` > 0, else 0.
    fn where_positive(self, gate: Self) -> Self;
    fn widen(self) -> Self::Wide;
    /// Three packs in binary64.
    #[inline(always)]
    fn widen3([x, y, z]: [Self; 3]) -> [Self::Wide; 3] {
        [x.widen(), y.widen(), z.widen()]
    }
    /// Lanes from binary32.
    #[inline(always)]
    fn from_singles(values: &[f32; LANES]) -> Self {
        let mut lanes = [Self::Number::default(); LANES];
        for lane in 0..LANES {
            lanes[lane] = Self::Number::of(f64::from(values[lane]));
        }
        Self::load(&lanes)
    }
    /// Lanes rounded to binary32.
    #[inline(always)]
    fn to_singles(self) -> [f32; LANES] {
        let lanes = self.store();
        let mut values = [0.0; LANES];
        for lane in 0..LANES {
            values[lane] = lanes[lane].to_f64() as f32;
        }
        values
    }
    /// The three components of both vectors of sixteen records.
    ///
    /// # Safety
    /// Every index is below `records.len()`.
    #[inline(always)]
    #[allow(unsafe_code, reason = "as for the method that it calls")]
    unsafe fn gather(records: &[Record<Self::Number>], indices: &[u16; LANES]) -> [[Self; 3]; 2] {
        // SAFETY: the caller promises indices in range.
        unsafe { Self::gather_part(records, indices, 0) }
    }

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
    fn repeat(quad: &[Self::Number; 4]) -> Self;
    /// Each of four numbers four times: lane 4 g + c holds `quad[g]`.
    fn spread(quad: &[Self::Number; 4]) -> Self;
    /// Sums over the quads: (q0 + q2) + (q1 + q3).
    fn fold(self) -> [Self::Number; 4];
    /// Whether any lane of a gate is on: gates are 1 or 0.
    #[inline(always)]
    fn any(self) -> bool {
        self.fold() != [Self::Number::default(); 4]
    }
    /// Four packs from sixteen quads: lane l of pack c holds `quads[l][c]`.
    fn columns(quads: &[[Self::Number; 4]; LANES]) -> [Self; 4];
    /// Sixteen quads from four packs.
    fn rows(columns: [Self; 4]) -> [[Self::Number; 4]; LANES];
}
