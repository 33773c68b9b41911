//! Packs in 512-bit registers: one for binary32, two for binary64.
//!
//! SAFETY of the whole file: only `dispatch` names these types, after `detect` has found AVX-512
//! F, DQ and VL; nothing else makes these intrinsics unsafe but pointers, which carry their own
//! comment.
#![allow(unsafe_code, reason = "intrinsics")]
#![allow(clippy::undocumented_unsafe_blocks, reason = "stated once at the top of the file")]

#[allow(clippy::wildcard_imports, reason = "the list would be as long as the file")]
use std::arch::x86_64::*;

use super::pack::{LANES, Pack, Padded};

#[derive(Clone, Copy)]
pub(crate) struct F32x16(__m512);

#[derive(Clone, Copy)]
pub(crate) struct F64x16([__m512d; 2]);

impl Pack<f32> for F32x16 {
    type Wide = F64x16;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(unsafe { _mm512_set1_ps(value) })
    }
    #[inline(always)]
    fn load(values: &[f32; LANES]) -> Self {
        Self(unsafe { _mm512_loadu_ps(values.as_ptr()) })
    }
    #[inline(always)]
    fn store(self) -> [f32; LANES] {
        let mut values = [0.0; LANES];
        unsafe { _mm512_storeu_ps(values.as_mut_ptr(), self.0) };
        values
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(unsafe { _mm512_add_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(unsafe { _mm512_sub_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(unsafe { _mm512_mul_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(unsafe { _mm512_sqrt_ps(self.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(unsafe { _mm512_abs_ps(self.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(unsafe { _mm512_max_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn inverse_or_zero(self) -> Self {
        unsafe {
            let positive = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(self.0, _mm512_setzero_ps());
            Self(_mm512_maskz_div_ps(positive, _mm512_set1_ps(1.0), self.0))
        }
    }
    #[inline(always)]
    fn where_positive(self, gate: Self) -> Self {
        unsafe {
            let positive = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(gate.0, _mm512_setzero_ps());
            Self(_mm512_maskz_mov_ps(positive, self.0))
        }
    }
    #[inline(always)]
    fn widen(self) -> F64x16 {
        unsafe {
            let low = _mm512_castps512_ps256(self.0);
            let high = _mm512_extractf32x8_ps::<1>(self.0);
            F64x16([_mm512_cvtps_pd(low), _mm512_cvtps_pd(high)])
        }
    }
    #[inline(always)]
    unsafe fn gather(field: &[Padded<f32>], indices: &[u32; LANES]) -> [Self; 3] {
        // SAFETY: the caller promises indices in range; a padded vector is four numbers.
        unsafe {
            let one = |i: usize| _mm_loadu_ps(field.as_ptr().add(indices[i] as usize).cast());
            let (a, b) =
                (Self::join(one(0), one(4), one(8), one(12)), Self::join(one(1), one(5), one(9), one(13)));
            let (c, d) =
                (Self::join(one(2), one(6), one(10), one(14)), Self::join(one(3), one(7), one(11), one(15)));
            let xy_ab = _mm512_castps_pd(_mm512_unpacklo_ps(a, b));
            let xy_cd = _mm512_castps_pd(_mm512_unpacklo_ps(c, d));
            let z_ab = _mm512_castps_pd(_mm512_unpackhi_ps(a, b));
            let z_cd = _mm512_castps_pd(_mm512_unpackhi_ps(c, d));
            [
                Self(_mm512_castpd_ps(_mm512_unpacklo_pd(xy_ab, xy_cd))),
                Self(_mm512_castpd_ps(_mm512_unpackhi_pd(xy_ab, xy_cd))),
                Self(_mm512_castpd_ps(_mm512_unpacklo_pd(z_ab, z_cd))),
            ]
        }
    }
}

impl F32x16 {
    /// Four 128-bit parts.
    #[inline(always)]
    fn join(a: __m128, b: __m128, c: __m128, d: __m128) -> __m512 {
        unsafe {
            let parts = _mm512_insertf32x4::<1>(_mm512_castps128_ps512(a), b);
            _mm512_insertf32x4::<3>(_mm512_insertf32x4::<2>(parts, c), d)
        }
    }
}

impl F64x16 {
    /// Components of eight vectors.
    #[inline(always)]
    unsafe fn gather_half(field: &[Padded<f64>], indices: &[u32]) -> [__m512d; 3] {
        // SAFETY: the caller promises indices in range; a padded vector is four numbers.
        unsafe {
            let one = |i: usize| _mm256_loadu_pd(field.as_ptr().add(indices[i] as usize).cast());
            let a = _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(one(0)), one(4));
            let b = _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(one(1)), one(5));
            let c = _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(one(2)), one(6));
            let d = _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(one(3)), one(7));
            let (xz_ab, xz_cd) = (_mm512_unpacklo_pd(a, b), _mm512_unpacklo_pd(c, d));
            let (y_ab, y_cd) = (_mm512_unpackhi_pd(a, b), _mm512_unpackhi_pd(c, d));
            let first = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
            let second = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
            [
                _mm512_permutex2var_pd(xz_ab, first, xz_cd),
                _mm512_permutex2var_pd(y_ab, first, y_cd),
                _mm512_permutex2var_pd(xz_ab, second, xz_cd),
            ]
        }
    }
}

impl Pack<f64> for F64x16 {
    type Wide = Self;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([unsafe { _mm512_set1_pd(value) }; 2])
    }
    #[inline(always)]
    fn load(values: &[f64; LANES]) -> Self {
        let (low, high) = values.split_at(LANES / 2);
        Self(unsafe { [_mm512_loadu_pd(low.as_ptr()), _mm512_loadu_pd(high.as_ptr())] })
    }
    #[inline(always)]
    fn store(self) -> [f64; LANES] {
        let mut values = [0.0; LANES];
        let (low, high) = values.split_at_mut(LANES / 2);
        unsafe {
            _mm512_storeu_pd(low.as_mut_ptr(), self.0[0]);
            _mm512_storeu_pd(high.as_mut_ptr(), self.0[1]);
        }
        values
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(unsafe { [_mm512_add_pd(self.0[0], other.0[0]), _mm512_add_pd(self.0[1], other.0[1])] })
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(unsafe { [_mm512_sub_pd(self.0[0], other.0[0]), _mm512_sub_pd(self.0[1], other.0[1])] })
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(unsafe { [_mm512_mul_pd(self.0[0], other.0[0]), _mm512_mul_pd(self.0[1], other.0[1])] })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(unsafe { [_mm512_sqrt_pd(self.0[0]), _mm512_sqrt_pd(self.0[1])] })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(unsafe { [_mm512_abs_pd(self.0[0]), _mm512_abs_pd(self.0[1])] })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(unsafe { [_mm512_max_pd(self.0[0], other.0[0]), _mm512_max_pd(self.0[1], other.0[1])] })
    }
    #[inline(always)]
    fn inverse_or_zero(self) -> Self {
        let one = Self::splat(1.0);
        let inverse =
            Self(unsafe { [_mm512_div_pd(one.0[0], self.0[0]), _mm512_div_pd(one.0[1], self.0[1])] });
        inverse.where_positive(self)
    }
    #[inline(always)]
    fn where_positive(self, gate: Self) -> Self {
        unsafe {
            let zero = _mm512_setzero_pd();
            let low = _mm512_cmp_pd_mask::<_CMP_GT_OQ>(gate.0[0], zero);
            let high = _mm512_cmp_pd_mask::<_CMP_GT_OQ>(gate.0[1], zero);
            Self([_mm512_maskz_mov_pd(low, self.0[0]), _mm512_maskz_mov_pd(high, self.0[1])])
        }
    }
    #[inline(always)]
    fn widen(self) -> Self {
        self
    }
    #[inline(always)]
    unsafe fn gather(field: &[Padded<f64>], indices: &[u32; LANES]) -> [Self; 3] {
        let (low, high) = indices.split_at(LANES / 2);
        // SAFETY: the caller promises indices in range.
        let (low, high) = unsafe { (Self::gather_half(field, low), Self::gather_half(field, high)) };
        [Self([low[0], high[0]]), Self([low[1], high[1]]), Self([low[2], high[2]])]
    }
}
