//! Packs in 512-bit registers: one for binary32, two for binary64.
//!
//! SAFETY of the whole file: only `dispatch` names these types, after `detect` has found AVX-512
//! F, DQ and VL; nothing else makes these intrinsics unsafe but pointers, which carry their own
//! comment.
#![allow(unsafe_code, reason = "intrinsics")]
#![allow(clippy::undocumented_unsafe_blocks, reason = "stated once at the top of the file")]

#[allow(clippy::wildcard_imports, reason = "the list would be as long as the file")]
use std::arch::x86_64::*;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use super::{
    super::real::{LANES, Lanes, Pack, Record},
    operators::{itself, operators, own, whole},
    portable::{Portable, quads_by_lanes},
};

#[derive(Clone, Copy)]
pub(crate) struct F32x16(__m512);

#[derive(Clone, Copy)]
pub(crate) struct F64x16([__m512d; 2]);

operators! {
    [] F32x16, f32;
    |a, b|
    + F32x16(unsafe { _mm512_add_ps(a.0, b.0) }),
    - F32x16(unsafe { _mm512_sub_ps(a.0, b.0) }),
    * F32x16(unsafe { _mm512_mul_ps(a.0, b.0) }),
    / F32x16(unsafe { _mm512_div_ps(a.0, b.0) })
}

operators! {
    [] F64x16, f64;
    |a, b|
    + F64x16(unsafe { [_mm512_add_pd(a.0[0], b.0[0]), _mm512_add_pd(a.0[1], b.0[1])] }),
    - F64x16(unsafe { [_mm512_sub_pd(a.0[0], b.0[0]), _mm512_sub_pd(a.0[1], b.0[1])] }),
    * F64x16(unsafe { [_mm512_mul_pd(a.0[0], b.0[0]), _mm512_mul_pd(a.0[1], b.0[1])] }),
    / F64x16(unsafe { [_mm512_div_pd(a.0[0], b.0[0]), _mm512_div_pd(a.0[1], b.0[1])] })
}

own!([] F32x16, f32, |records, indices| unsafe { Self::gather_all(records, indices) });

impl F32x16 {
    #[inline(always)]
    unsafe fn gather_all(records: &[Record<f32>], indices: &[u16; LANES]) -> [[Self; 3]; 2] {
        // SAFETY: the caller promises indices in range; a record is two vectors of four numbers.
        unsafe {
            let one = |i: usize| records.as_ptr().add(indices[i] as usize).cast::<f32>();
            let a = Self::both([one(0), one(4), one(8), one(12)]);
            let b = Self::both([one(1), one(5), one(9), one(13)]);
            let c = Self::both([one(2), one(6), one(10), one(14)]);
            let d = Self::both([one(3), one(7), one(11), one(15)]);
            [Self::three([a[0], b[0], c[0], d[0]]), Self::three([a[1], b[1], c[1], d[1]])]
        }
    }
}

impl Pack for F32x16 {
    itself!();
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
    fn inverse_above(self, least: Self) -> Self {
        unsafe {
            let greater = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(self.0, least.0);
            Self(_mm512_maskz_div_ps(greater, _mm512_set1_ps(1.0), self.0))
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
    fn min(self, other: Self) -> Self {
        Self(unsafe { _mm512_min_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Self(unsafe { _mm512_roundscale_ps::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(self.0) })
    }
    #[inline(always)]
    fn if_less(self, other: Self, then: Self, otherwise: Self) -> Self {
        unsafe {
            let less = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0);
            Self(_mm512_mask_blend_ps(less, otherwise.0, then.0))
        }
    }
    #[inline(always)]
    fn with_sign_of(self, other: Self) -> Self {
        unsafe {
            let sign = _mm512_set1_ps(-0.0);
            Self(_mm512_or_ps(_mm512_andnot_ps(sign, self.0), _mm512_and_ps(sign, other.0)))
        }
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        unsafe {
            let shifted = _mm512_slli_epi32::<23>(_mm512_castps_si512(self.0));
            Self(_mm512_castsi512_ps(_mm512_add_epi32(shifted, _mm512_castps_si512(_mm512_set1_ps(1.0)))))
        }
    }
    #[inline(always)]
    fn whole(self) -> [u16; LANES] {
        let mut whole = [0; LANES];
        // SAFETY: sixteen numbers of sixteen bits.
        unsafe {
            let numbers = _mm512_cvtepi32_epi16(_mm512_cvtps_epi32(self.0));
            _mm256_storeu_si256(whole.as_mut_ptr().cast(), numbers);
        }
        whole
    }
    #[inline(always)]
    fn repeat(quad: &[f32; 4]) -> Self {
        Self(unsafe { _mm512_broadcast_f32x4(_mm_loadu_ps(quad.as_ptr())) })
    }
    #[inline(always)]
    fn spread(quad: &[f32; 4]) -> Self {
        unsafe {
            let places = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
            Self(_mm512_permutexvar_ps(places, _mm512_castps128_ps512(_mm_loadu_ps(quad.as_ptr()))))
        }
    }
    #[inline(always)]
    fn fold(self) -> [f32; 4] {
        unsafe {
            let half = _mm256_add_ps(_mm512_castps512_ps256(self.0), _mm512_extractf32x8_ps::<1>(self.0));
            let quad = _mm_add_ps(_mm256_castps256_ps128(half), _mm256_extractf128_ps::<1>(half));
            let mut sums = [0.0; 4];
            _mm_storeu_ps(sums.as_mut_ptr(), quad);
            sums
        }
    }
    #[inline(always)]
    fn columns(quads: &[[f32; 4]; LANES]) -> [Self; 4] {
        let four = [Self::four(quads, 0), Self::four(quads, 1), Self::four(quads, 2), Self::four(quads, 3)];
        let [a, b, c, d] = Self::transpose(four);
        [Self(a), Self(b), Self(c), Self(d)]
    }
    #[inline(always)]
    fn rows(columns: [Self; 4]) -> [[f32; 4]; LANES] {
        unsafe {
            let rows = Self::transpose([columns[0].0, columns[1].0, columns[2].0, columns[3].0]);
            let mut quads = [[0.0; 4]; LANES];
            for i in 0..4 {
                _mm_storeu_ps(quads[i].as_mut_ptr(), _mm512_castps512_ps128(rows[i]));
                _mm_storeu_ps(quads[i + 4].as_mut_ptr(), _mm512_extractf32x4_ps::<1>(rows[i]));
                _mm_storeu_ps(quads[i + 8].as_mut_ptr(), _mm512_extractf32x4_ps::<2>(rows[i]));
                _mm_storeu_ps(quads[i + 12].as_mut_ptr(), _mm512_extractf32x4_ps::<3>(rows[i]));
            }
            quads
        }
    }
}

impl F32x16 {
    /// Quads i, i + 4, i + 8, i + 12.
    #[inline(always)]
    fn four(quads: &[[f32; 4]; LANES], i: usize) -> __m512 {
        unsafe {
            Self::join(
                _mm_loadu_ps(quads[i].as_ptr()),
                _mm_loadu_ps(quads[i + 4].as_ptr()),
                _mm_loadu_ps(quads[i + 8].as_ptr()),
                _mm_loadu_ps(quads[i + 12].as_ptr()),
            )
        }
    }

    /// The first vectors of four records, and the second.
    #[inline(always)]
    unsafe fn both(records: [*const f32; 4]) -> [__m512; 2] {
        // SAFETY: the caller promises records of eight numbers.
        unsafe {
            let low = _mm512_castps256_ps512(_mm256_loadu_ps(records[0]));
            let low = _mm512_insertf32x8::<1>(low, _mm256_loadu_ps(records[1]));
            let high = _mm512_castps256_ps512(_mm256_loadu_ps(records[2]));
            let high = _mm512_insertf32x8::<1>(high, _mm256_loadu_ps(records[3]));
            [_mm512_shuffle_f32x4::<0x88>(low, high), _mm512_shuffle_f32x4::<0xDD>(low, high)]
        }
    }

    /// Components of sixteen vectors, of which register i holds those of lanes i, i + 4, i + 8, i + 12.
    #[inline(always)]
    unsafe fn three(quads: [__m512; 4]) -> [Self; 3] {
        let [x, y, z, _] = Self::transpose(quads);
        [Self(x), Self(y), Self(z)]
    }

    /// Transposes 4 x 4 numbers in each 128-bit part.
    #[inline(always)]
    fn transpose([a, b, c, d]: [__m512; 4]) -> [__m512; 4] {
        unsafe {
            let ab_low = _mm512_castps_pd(_mm512_unpacklo_ps(a, b));
            let cd_low = _mm512_castps_pd(_mm512_unpacklo_ps(c, d));
            let ab_high = _mm512_castps_pd(_mm512_unpackhi_ps(a, b));
            let cd_high = _mm512_castps_pd(_mm512_unpackhi_ps(c, d));
            [
                _mm512_castpd_ps(_mm512_unpacklo_pd(ab_low, cd_low)),
                _mm512_castpd_ps(_mm512_unpackhi_pd(ab_low, cd_low)),
                _mm512_castpd_ps(_mm512_unpacklo_pd(ab_high, cd_high)),
                _mm512_castpd_ps(_mm512_unpackhi_pd(ab_high, cd_high)),
            ]
        }
    }

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
    #[inline(always)]
    unsafe fn gather_all(records: &[Record<f64>], indices: &[u16; LANES]) -> [[Self; 3]; 2] {
        let (low, high) = indices.split_at(LANES / 2);
        // SAFETY: the caller promises indices in range.
        unsafe {
            let (x, other_x) = (Self::gather_half(records, 0, low), Self::gather_half(records, 0, high));
            let (v, other_v) = (Self::gather_half(records, 1, low), Self::gather_half(records, 1, high));
            [
                [Self([x[0], other_x[0]]), Self([x[1], other_x[1]]), Self([x[2], other_x[2]])],
                [Self([v[0], other_v[0]]), Self([v[1], other_v[1]]), Self([v[2], other_v[2]])],
            ]
        }
    }

    /// Components of one of the two vectors of eight records.
    #[inline(always)]
    unsafe fn gather_half(records: &[Record<f64>], vector: usize, indices: &[u16]) -> [__m512d; 3] {
        // SAFETY: the caller promises indices in range; a record is two vectors of four numbers.
        unsafe {
            let one = |i: usize| records.as_ptr().add(indices[i] as usize).cast::<f64>().add(4 * vector);
            let two = |i: usize| {
                let low = _mm512_castpd256_pd512(_mm256_loadu_pd(one(i)));
                _mm512_insertf64x4::<1>(low, _mm256_loadu_pd(one(i + 4)))
            };
            let (a, b, c, d) = (two(0), two(1), two(2), two(3));
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

own!([] F64x16, f64, |records, indices| unsafe { Self::gather_all(records, indices) });

impl Pack for F64x16 {
    itself!();
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
    fn inverse_above(self, least: Self) -> Self {
        unsafe {
            let one = _mm512_set1_pd(1.0);
            let low = _mm512_cmp_pd_mask::<_CMP_GT_OQ>(self.0[0], least.0[0]);
            let high = _mm512_cmp_pd_mask::<_CMP_GT_OQ>(self.0[1], least.0[1]);
            Self([_mm512_maskz_div_pd(low, one, self.0[0]), _mm512_maskz_div_pd(high, one, self.0[1])])
        }
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
    fn min(self, other: Self) -> Self {
        Self(unsafe { [_mm512_min_pd(self.0[0], other.0[0]), _mm512_min_pd(self.0[1], other.0[1])] })
    }
    #[inline(always)]
    fn floor(self) -> Self {
        const DOWN: i32 = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;
        Self(unsafe { [_mm512_roundscale_pd::<DOWN>(self.0[0]), _mm512_roundscale_pd::<DOWN>(self.0[1])] })
    }
    #[inline(always)]
    fn if_less(self, other: Self, then: Self, otherwise: Self) -> Self {
        unsafe {
            let low = _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0[0], other.0[0]);
            let high = _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0[1], other.0[1]);
            Self([
                _mm512_mask_blend_pd(low, otherwise.0[0], then.0[0]),
                _mm512_mask_blend_pd(high, otherwise.0[1], then.0[1]),
            ])
        }
    }
    #[inline(always)]
    fn with_sign_of(self, other: Self) -> Self {
        unsafe {
            let sign = _mm512_set1_pd(-0.0);
            Self([
                _mm512_or_pd(_mm512_andnot_pd(sign, self.0[0]), _mm512_and_pd(sign, other.0[0])),
                _mm512_or_pd(_mm512_andnot_pd(sign, self.0[1]), _mm512_and_pd(sign, other.0[1])),
            ])
        }
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        unsafe {
            let one = _mm512_castpd_si512(_mm512_set1_pd(1.0));
            let low = _mm512_add_epi64(_mm512_slli_epi64::<52>(_mm512_castpd_si512(self.0[0])), one);
            let high = _mm512_add_epi64(_mm512_slli_epi64::<52>(_mm512_castpd_si512(self.0[1])), one);
            Self([_mm512_castsi512_pd(low), _mm512_castsi512_pd(high)])
        }
    }
    #[inline(always)]
    fn whole(self) -> [u16; LANES] {
        Portable::load(&self.store()).whole()
    }

    quads_by_lanes!(f64);
}
