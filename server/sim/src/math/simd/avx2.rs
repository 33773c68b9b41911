//! Packs in 256-bit registers: two for binary32, four for binary64.
//!
//! SAFETY of the whole file: only `dispatch` names these types, after `detect` has found AVX2;
//! nothing else makes these intrinsics unsafe but pointers, which carry their own comment.
#![allow(unsafe_code, reason = "intrinsics")]
#![allow(clippy::undocumented_unsafe_blocks, reason = "stated once at the top of the file")]

#[allow(clippy::wildcard_imports, reason = "the list would be as long as the file")]
use std::arch::x86_64::*;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use super::{
    super::{
        array::three,
        real::{LANES, Lanes, Pack, Record},
    },
    operators::{operators, whole},
    portable::Portable,
    register::{F32x8, F64x4},
};

#[derive(Clone, Copy)]
pub(crate) struct F32x16([__m256; 2]);

#[derive(Clone, Copy)]
pub(crate) struct F64x16([__m256d; 4]);

/// Applies an instruction register by register.
macro_rules! each {
    ($pack:ident, $instruction:ident($a:ident, $b:ident), [$($i:literal)+]) => {
        $pack(unsafe { [$($instruction($a.0[$i], $b.0[$i])),+] })
    };
}

operators! {
    [] F32x16, f32;
    |a, b|
    + each!(F32x16, _mm256_add_ps(a, b), [0 1]),
    - each!(F32x16, _mm256_sub_ps(a, b), [0 1]),
    * each!(F32x16, _mm256_mul_ps(a, b), [0 1]),
    / each!(F32x16, _mm256_div_ps(a, b), [0 1])
}

operators! {
    [] F64x16, f64;
    |a, b|
    + each!(F64x16, _mm256_add_pd(a, b), [0 1 2 3]),
    - each!(F64x16, _mm256_sub_pd(a, b), [0 1 2 3]),
    * each!(F64x16, _mm256_mul_pd(a, b), [0 1 2 3]),
    / each!(F64x16, _mm256_div_pd(a, b), [0 1 2 3])
}

/// The operations that are the same for both precisions but for their intrinsics. Registers are
/// written out one by one: a closure may not be compiled for the instructions that it calls.
macro_rules! lanewise {
    ($number:ty, $register:ident, $wide:ty, $registers:literal [$($i:literal)+], $splat:ident, $load:ident, $store:ident,
     $div:ident, $sqrt:ident, $max:ident, $and:ident, $andnot:ident,
     $cmp:ident, $min:ident, $floor:ident, $or:ident, $blend:ident, $to_bits:ident, $from_bits:ident,
     $shift:ident::<$significand:literal>, $add_bits:ident, $signs:ident) => {
        type Register = $register;
        type Wide = $wide;

        #[inline(always)]
        fn register(self, part: usize) -> $register {
            $register(self.0[part])
        }
        #[inline(always)]
        fn set_register(&mut self, part: usize, lanes: $register) {
            self.0[part] = lanes.0;
        }
        #[inline(always)]
        fn any(self) -> bool {
            let on = unsafe { $($signs($cmp::<_CMP_NEQ_UQ>(self.0[$i], $splat(0.0))))|+ };
            on != 0
        }
        #[inline(always)]
        fn splat(value: $number) -> Self {
            Self([unsafe { $splat(value) }; $registers])
        }
        #[inline(always)]
        fn load(values: &[$number; LANES]) -> Self {
            // SAFETY: register i holds LANES / registers numbers of the array.
            Self(unsafe { [$($load(values.as_ptr().add($i * LANES / $registers))),+] })
        }
        #[inline(always)]
        fn store(self) -> [$number; LANES] {
            let mut values = [0.0; LANES];
            // SAFETY: register i holds LANES / registers numbers of the array.
            unsafe { $($store(values.as_mut_ptr().add($i * LANES / $registers), self.0[$i]);)+ }
            values
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            Self(unsafe { [$($sqrt(self.0[$i])),+] })
        }
        #[inline(always)]
        fn abs(self) -> Self {
            Self(unsafe { [$($andnot($splat(-0.0), self.0[$i])),+] })
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            Self(unsafe { [$($max(self.0[$i], other.0[$i])),+] })
        }
        #[inline(always)]
        fn inverse_above(self, least: Self) -> Self {
            Self(unsafe {
                [$($and($cmp::<_CMP_GT_OQ>(self.0[$i], least.0[$i]), $div($splat(1.0), self.0[$i]))),+]
            })
        }
        #[inline(always)]
        fn where_positive(self, gate: Self) -> Self {
            Self(unsafe { [$($and($cmp::<_CMP_GT_OQ>(gate.0[$i], $splat(0.0)), self.0[$i])),+] })
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            Self(unsafe { [$($min(self.0[$i], other.0[$i])),+] })
        }
        #[inline(always)]
        fn floor(self) -> Self {
            Self(unsafe { [$($floor(self.0[$i])),+] })
        }
        #[inline(always)]
        fn if_less(self, other: Self, then: Self, otherwise: Self) -> Self {
            Self(unsafe {
                [$($blend(otherwise.0[$i], then.0[$i], $cmp::<_CMP_LT_OQ>(self.0[$i], other.0[$i]))),+]
            })
        }
        #[inline(always)]
        fn with_sign_of(self, other: Self) -> Self {
            Self(unsafe {
                [$($or($andnot($splat(-0.0), self.0[$i]), $and($splat(-0.0), other.0[$i]))),+]
            })
        }
        #[inline(always)]
        fn power_of_two(self) -> Self {
            Self(unsafe {
                [$($from_bits($add_bits($shift::<$significand>($to_bits(self.0[$i])), $to_bits($splat(1.0))))),+]
            })
        }
    };
}

whole!([] F32x16, f32, |records, indices| {
    // SAFETY: the caller promises indices in range.
    let [low, high] =
        unsafe { [F32x8::gather_part(records, indices, 0), F32x8::gather_part(records, indices, 1)] };
    let ([x, v], [other_x, other_v]) = (low, high);
    [
        [Self::of_two(x[0], other_x[0]), Self::of_two(x[1], other_x[1]), Self::of_two(x[2], other_x[2])],
        [Self::of_two(v[0], other_v[0]), Self::of_two(v[1], other_v[1]), Self::of_two(v[2], other_v[2])],
    ]
});

whole!([] F64x16, f64, |records, indices| {
    // SAFETY: the caller promises indices in range.
    unsafe { [Self::gather_one(records, 0, indices), Self::gather_one(records, 1, indices)] }
});

impl F32x16 {
    #[inline(always)]
    fn of_two(low: F32x8, high: F32x8) -> Self {
        Self([low.0, high.0])
    }
}

impl F64x16 {
    /// Components of one of the two vectors of sixteen records.
    #[inline(always)]
    unsafe fn gather_one(records: &[Record<f64>], vector: usize, indices: &[u16; LANES]) -> [Self; 3] {
        // SAFETY: the caller promises indices in range.
        unsafe {
            let a = F64x4::gather_one(records, vector, indices, 0);
            let b = F64x4::gather_one(records, vector, indices, 1);
            let c = F64x4::gather_one(records, vector, indices, 2);
            let d = F64x4::gather_one(records, vector, indices, 3);
            three!(|i| Self([a[i].0, b[i].0, c[i].0, d[i].0]))
        }
    }
}

impl Pack for F32x16 {
    lanewise!(
        f32,
        F32x8,
        F64x16,
        2 [0 1],
        _mm256_set1_ps,
        _mm256_loadu_ps,
        _mm256_storeu_ps,
        _mm256_div_ps,
        _mm256_sqrt_ps,
        _mm256_max_ps,
        _mm256_and_ps,
        _mm256_andnot_ps,
        _mm256_cmp_ps,
        _mm256_min_ps,
        _mm256_floor_ps,
        _mm256_or_ps,
        _mm256_blendv_ps,
        _mm256_castps_si256,
        _mm256_castsi256_ps,
        _mm256_slli_epi32::<23>,
        _mm256_add_epi32,
        _mm256_movemask_ps
    );

    #[inline(always)]
    fn whole(self) -> [u16; LANES] {
        let mut whole = [0; LANES];
        // SAFETY: sixteen numbers of sixteen bits.
        unsafe {
            let packed = _mm256_packus_epi32(_mm256_cvtps_epi32(self.0[0]), _mm256_cvtps_epi32(self.0[1]));
            // Halves were packed side by side: 0 2 | 1 3.
            _mm256_storeu_si256(whole.as_mut_ptr().cast(), _mm256_permute4x64_epi64::<0b11_01_10_00>(packed));
        }
        whole
    }

    #[inline(always)]
    fn widen(self) -> F64x16 {
        unsafe {
            F64x16([
                _mm256_cvtps_pd(_mm256_castps256_ps128(self.0[0])),
                _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(self.0[0])),
                _mm256_cvtps_pd(_mm256_castps256_ps128(self.0[1])),
                _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(self.0[1])),
            ])
        }
    }

    #[inline(always)]
    fn repeat(quad: &[f32; 4]) -> Self {
        unsafe {
            let quad = _mm_loadu_ps(quad.as_ptr());
            Self([_mm256_set_m128(quad, quad); 2])
        }
    }
    #[inline(always)]
    fn spread(quad: &[f32; 4]) -> Self {
        unsafe {
            let [a, b, c, d] =
                [_mm_set1_ps(quad[0]), _mm_set1_ps(quad[1]), _mm_set1_ps(quad[2]), _mm_set1_ps(quad[3])];
            Self([_mm256_set_m128(b, a), _mm256_set_m128(d, c)])
        }
    }
    #[inline(always)]
    fn fold(self) -> [f32; 4] {
        unsafe {
            let half = _mm256_add_ps(self.0[0], self.0[1]);
            let quad = _mm_add_ps(_mm256_castps256_ps128(half), _mm256_extractf128_ps::<1>(half));
            let mut sums = [0.0; 4];
            _mm_storeu_ps(sums.as_mut_ptr(), quad);
            sums
        }
    }
    #[inline(always)]
    fn columns(quads: &[[f32; 4]; LANES]) -> [Self; 4] {
        let low = Self::transpose([
            Self::two(quads, 0),
            Self::two(quads, 1),
            Self::two(quads, 2),
            Self::two(quads, 3),
        ]);
        let high = Self::transpose([
            Self::two(quads, 8),
            Self::two(quads, 9),
            Self::two(quads, 10),
            Self::two(quads, 11),
        ]);
        [Self([low[0], high[0]]), Self([low[1], high[1]]), Self([low[2], high[2]]), Self([low[3], high[3]])]
    }
    #[inline(always)]
    fn rows(columns: [Self; 4]) -> [[f32; 4]; LANES] {
        unsafe {
            let mut quads = [[0.0; 4]; LANES];
            for half in 0..2 {
                let columns =
                    [columns[0].0[half], columns[1].0[half], columns[2].0[half], columns[3].0[half]];
                let rows = Self::transpose(columns);
                for i in 0..4 {
                    _mm_storeu_ps(quads[8 * half + i].as_mut_ptr(), _mm256_castps256_ps128(rows[i]));
                    _mm_storeu_ps(quads[8 * half + i + 4].as_mut_ptr(), _mm256_extractf128_ps::<1>(rows[i]));
                }
            }
            quads
        }
    }
}

impl F32x16 {
    /// Quads i and i + 4.
    #[inline(always)]
    fn two(quads: &[[f32; 4]; LANES], i: usize) -> __m256 {
        unsafe { _mm256_set_m128(_mm_loadu_ps(quads[i + 4].as_ptr()), _mm_loadu_ps(quads[i].as_ptr())) }
    }

    /// Transposes 4 x 4 numbers in each 128-bit part.
    #[inline(always)]
    fn transpose([a, b, c, d]: [__m256; 4]) -> [__m256; 4] {
        unsafe {
            let ab_low = _mm256_castps_pd(_mm256_unpacklo_ps(a, b));
            let cd_low = _mm256_castps_pd(_mm256_unpacklo_ps(c, d));
            let ab_high = _mm256_castps_pd(_mm256_unpackhi_ps(a, b));
            let cd_high = _mm256_castps_pd(_mm256_unpackhi_ps(c, d));
            [
                _mm256_castpd_ps(_mm256_unpacklo_pd(ab_low, cd_low)),
                _mm256_castpd_ps(_mm256_unpackhi_pd(ab_low, cd_low)),
                _mm256_castpd_ps(_mm256_unpacklo_pd(ab_high, cd_high)),
                _mm256_castpd_ps(_mm256_unpackhi_pd(ab_high, cd_high)),
            ]
        }
    }
}

impl Pack for F64x16 {
    lanewise!(
        f64,
        F64x4,
        Self,
        4 [0 1 2 3],
        _mm256_set1_pd,
        _mm256_loadu_pd,
        _mm256_storeu_pd,
        _mm256_div_pd,
        _mm256_sqrt_pd,
        _mm256_max_pd,
        _mm256_and_pd,
        _mm256_andnot_pd,
        _mm256_cmp_pd,
        _mm256_min_pd,
        _mm256_floor_pd,
        _mm256_or_pd,
        _mm256_blendv_pd,
        _mm256_castpd_si256,
        _mm256_castsi256_pd,
        _mm256_slli_epi64::<52>,
        _mm256_add_epi64,
        _mm256_movemask_pd
    );

    #[inline(always)]
    fn whole(self) -> [u16; LANES] {
        Portable::load(&self.store()).whole()
    }

    #[inline(always)]
    fn widen(self) -> Self {
        self
    }

    #[inline(always)]
    fn repeat(quad: &[f64; 4]) -> Self {
        Self([unsafe { _mm256_loadu_pd(quad.as_ptr()) }; 4])
    }
    #[inline(always)]
    fn spread(quad: &[f64; 4]) -> Self {
        unsafe {
            let [a, b] = [_mm256_set1_pd(quad[0]), _mm256_set1_pd(quad[1])];
            Self([a, b, _mm256_set1_pd(quad[2]), _mm256_set1_pd(quad[3])])
        }
    }
    #[inline(always)]
    fn fold(self) -> [f64; 4] {
        let [a, b, c, d] = self.0;
        let mut sums = [0.0; 4];
        unsafe {
            let quad = _mm256_add_pd(_mm256_add_pd(a, c), _mm256_add_pd(b, d));
            _mm256_storeu_pd(sums.as_mut_ptr(), quad);
        }
        sums
    }
    #[inline(always)]
    fn columns(quads: &[[f64; 4]; LANES]) -> [Self; 4] {
        let (a, b) = (F64x4::columns(quads, 0), F64x4::columns(quads, 1));
        let (c, d) = (F64x4::columns(quads, 2), F64x4::columns(quads, 3));
        let [x, y, z] = three!(|i| Self([a[i].0, b[i].0, c[i].0, d[i].0]));
        [x, y, z, Self([a[3].0, b[3].0, c[3].0, d[3].0])]
    }
    #[inline(always)]
    fn rows(columns: [Self; 4]) -> [[f64; 4]; LANES] {
        let [x, y, z, w] = columns;
        let mut quads = [[0.0; 4]; LANES];
        for part in 0..4 {
            F64x4::write_rows([x.0[part], y.0[part], z.0[part], w.0[part]], part, &mut quads);
        }
        quads
    }
}
