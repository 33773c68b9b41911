//! exp of sixteen numbers at a time, with the same bits on every processor: no C library.
//!
//! x = n ln 2 + r, |r| <= ln 2 / 2; exp r by its Taylor polynomial (Horner), times 2^n. Relative
//! error below 3 units of rounding. Results are kept within the normal range: x is held between
//! -87 and 87 in binary32, -708 and 708 in binary64.

use super::{Pack, Real, real::Rounding};

/// 1/k! for k = 0 ...: binary32 needs 8 terms, binary64 14.
const TAYLOR: [f64; 14] = [
    1.0,
    1.0,
    1.0 / 2.0,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5_040.0,
    1.0 / 40_320.0,
    1.0 / 362_880.0,
    1.0 / 3_628_800.0,
    1.0 / 39_916_800.0,
    1.0 / 479_001_600.0,
    1.0 / 6_227_020_800.0,
];

/// exp x in every lane.
#[inline(always)]
pub(crate) fn exp<P: Pack>(x: P) -> P {
    let (terms, bound) = match P::Number::PRECISION {
        super::Precision::F32 => (8, 87.0),
        super::Precision::F64 => (14, 708.0),
    };
    let x = x.min(P::of(bound)).max(P::of(-bound));
    let magic = P::splat(P::Number::MAGIC);
    let shifted = x * P::of(std::f64::consts::LOG2_E) + magic;
    let n = shifted - magic;
    // ln 2 in two parts: the first has few bits, so that n times it is exact.
    let (high, low) = match P::Number::PRECISION {
        super::Precision::F32 => (0.693_359_375, -2.121_944_400_546_905_8e-4),
        super::Precision::F64 => (0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10),
    };
    let r = x - n * P::of(high) - n * P::of(low);
    let mut sum = P::of(TAYLOR[terms - 1]);
    for k in (0..terms - 1).rev() {
        sum = sum * r + P::of(TAYLOR[k]);
    }
    sum * shifted.power_of_two()
}

#[cfg(test)]
mod tests {
    use super::exp;
    use crate::math::{Pack, Portable};

    #[test]
    fn it_is_within_three_units_of_rounding() {
        for i in -6000..6000 {
            let x = f64::from(i) * 0.0113;
            let wide = exp(Portable::splat(x)).store()[0];
            let narrow = exp(Portable::splat(x as f32)).store()[0];
            #[allow(clippy::disallowed_methods, reason = "the reference")]
            let (wide_error, narrow_error) =
                (wide / x.exp() - 1.0, f64::from(narrow) / f64::from(x as f32).exp() - 1.0);
            assert!(wide_error.abs() < 3.0 * f64::EPSILON, "{x}: {wide_error:e}");
            assert!(narrow_error.abs() < 3.0 * f64::from(f32::EPSILON), "{x}: {narrow_error:e}");
        }
    }
}
