//! Four numbers at once: operations of IEEE 754, number by number, which compilers make vector instructions of.

use std::ops::{Add, Mul, Sub};

/// Numbers that are computed at once.
pub(super) const WIDTH: usize = 4;

/// Four numbers, each with its own lane of a vector register.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Four(pub(super) [f64; WIDTH]);

impl Four {
    /// The same number four times.
    #[inline(always)]
    pub(super) fn all(number: f64) -> Self {
        Self([number; WIDTH])
    }

    #[inline(always)]
    fn with(self, other: Self, of: impl Fn(f64, f64) -> f64) -> Self {
        let (Self(a), Self(b)) = (self, other);
        Self([of(a[0], b[0]), of(a[1], b[1]), of(a[2], b[2]), of(a[3], b[3])])
    }

    /// The larger of each two; the second where they cannot be compared.
    #[inline(always)]
    pub(super) fn max(self, other: Self) -> Self {
        self.with(other, |a, b| if a > b { a } else { b })
    }

    /// The smaller of each two; the second where they cannot be compared.
    #[inline(always)]
    pub(super) fn min(self, other: Self) -> Self {
        self.with(other, |a, b| if a < b { a } else { b })
    }

    /// `a` where this is 0 or more, and `b` elsewhere.
    #[inline(always)]
    pub(super) fn choose(self, Self(a): Self, Self(b): Self) -> Self {
        let of = |k: usize| if self.0[k] >= 0.0 { a[k] } else { b[k] };
        Self([of(0), of(1), of(2), of(3)])
    }
}

impl Default for Four {
    fn default() -> Self {
        Self::all(0.0)
    }
}

impl Add for Four {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.with(other, |a, b| a + b)
    }
}

impl Sub for Four {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.with(other, |a, b| a - b)
    }
}

impl Mul for Four {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.with(other, |a, b| a * b)
    }
}
