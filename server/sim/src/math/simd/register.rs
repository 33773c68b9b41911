//! Lanes of one 256-bit register: eight of binary32, four of binary64.
//!
//! There are sixteen registers with AVX2. A kernel that keeps nine values of sixteen lanes, as a product with springs
//! does, needs eighteen of them for binary32 and thirty-six for binary64, and most of its instructions would bring
//! registers to the stack and back; register by register all of it fits.
//!
//! SAFETY of the whole file: as in `avx2.rs`.
#![allow(unsafe_code, reason = "intrinsics")]
#![allow(clippy::undocumented_unsafe_blocks, reason = "stated once at the top of the file")]

#[allow(clippy::wildcard_imports, reason = "the list would be as long as the file")]
use std::arch::x86_64::*;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use super::{
    super::real::{LANES, Lanes, Record, Register},
    operators::operators,
};

/// Eight numbers of binary32.
#[derive(Clone, Copy)]
pub(crate) struct F32x8(pub(super) __m256);

/// Four numbers of binary64.
#[derive(Clone, Copy)]
pub(crate) struct F64x4(pub(super) __m256d);

operators! {
    [] F32x8, f32;
    |a, b|
    + F32x8(unsafe { _mm256_add_ps(a.0, b.0) }),
    - F32x8(unsafe { _mm256_sub_ps(a.0, b.0) }),
    * F32x8(unsafe { _mm256_mul_ps(a.0, b.0) }),
    / F32x8(unsafe { _mm256_div_ps(a.0, b.0) })
}

operators! {
    [] F64x4, f64;
    |a, b|
    + F64x4(unsafe { _mm256_add_pd(a.0, b.0) }),
    - F64x4(unsafe { _mm256_sub_pd(a.0, b.0) }),
    * F64x4(unsafe { _mm256_mul_pd(a.0, b.0) }),
    / F64x4(unsafe { _mm256_div_pd(a.0, b.0) })
}

/// What a register does with its one instruction, or with few.
macro_rules! register {
    ($register:ty, $number:ty, $splat:ident, $sqrt:ident, $and:ident, $andnot:ident, $or:ident, $cmp:ident,
     $blend:ident, $signs:ident) => {
        impl Register for $register {
            #[inline(always)]
            fn splat(value: $number) -> Self {
                Self(unsafe { $splat(value) })
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(unsafe { $sqrt(self.0) })
            }
            #[inline(always)]
            fn abs(self) -> Self {
                Self(unsafe { $andnot($splat(-0.0), self.0) })
            }
            #[inline(always)]
            fn if_less(self, other: Self, then: Self, otherwise: Self) -> Self {
                Self(unsafe { $blend(otherwise.0, then.0, $cmp::<_CMP_LT_OQ>(self.0, other.0)) })
            }
            #[inline(always)]
            fn with_sign_of(self, other: Self) -> Self {
                Self(unsafe { $or($andnot($splat(-0.0), self.0), $and($splat(-0.0), other.0)) })
            }
            #[inline(always)]
            fn any(self) -> bool {
                unsafe { $signs($cmp::<_CMP_NEQ_UQ>(self.0, $splat(0.0))) != 0 }
            }
        }
    };
}

register!(
    F32x8,
    f32,
    _mm256_set1_ps,
    _mm256_sqrt_ps,
    _mm256_and_ps,
    _mm256_andnot_ps,
    _mm256_or_ps,
    _mm256_cmp_ps,
    _mm256_blendv_ps,
    _mm256_movemask_ps
);

register!(
    F64x4,
    f64,
    _mm256_set1_pd,
    _mm256_sqrt_pd,
    _mm256_and_pd,
    _mm256_andnot_pd,
    _mm256_or_pd,
    _mm256_cmp_pd,
    _mm256_blendv_pd,
    _mm256_movemask_pd
);

impl F32x8 {
    /// The first vectors of two records, and the second.
    #[inline(always)]
    unsafe fn both(low: __m256, high: __m256) -> [__m256; 2] {
        unsafe { [_mm256_permute2f128_ps::<0x20>(low, high), _mm256_permute2f128_ps::<0x31>(low, high)] }
    }

    /// Components of eight vectors in four registers.
    #[inline(always)]
    unsafe fn three(a: __m256, b: __m256, c: __m256, d: __m256) -> [Self; 3] {
        unsafe {
            let xy_ab = _mm256_castps_pd(_mm256_unpacklo_ps(a, b));
            let xy_cd = _mm256_castps_pd(_mm256_unpacklo_ps(c, d));
            let z_ab = _mm256_castps_pd(_mm256_unpackhi_ps(a, b));
            let z_cd = _mm256_castps_pd(_mm256_unpackhi_ps(c, d));
            [
                Self(_mm256_castpd_ps(_mm256_unpacklo_pd(xy_ab, xy_cd))),
                Self(_mm256_castpd_ps(_mm256_unpackhi_pd(xy_ab, xy_cd))),
                Self(_mm256_castpd_ps(_mm256_unpacklo_pd(z_ab, z_cd))),
            ]
        }
    }
}

impl Lanes for F32x8 {
    type Number = f32;
    const PARTS: usize = 2;

    #[inline(always)]
    fn load_part(values: &[f32; LANES], part: usize) -> Self {
        let values: &[f32; 8] = &values.as_chunks().0[part];
        Self(unsafe { _mm256_loadu_ps(values.as_ptr()) })
    }

    #[inline(always)]
    fn store_part(self, values: &mut [f32; LANES], part: usize) {
        let values: &mut [f32; 8] = &mut values.as_chunks_mut().0[part];
        unsafe { _mm256_storeu_ps(values.as_mut_ptr(), self.0) };
    }

    #[inline(always)]
    unsafe fn gather_part(records: &[Record<f32>], indices: &[u16; LANES], part: usize) -> [[Self; 3]; 2] {
        let indices: &[u16; 8] = &indices.as_chunks().0[part];
        // SAFETY: the caller promises indices in range; a record is two vectors of four numbers.
        unsafe {
            let one = |i: usize| records.as_ptr().add(indices[i] as usize).cast::<f32>();
            let a = Self::both(_mm256_loadu_ps(one(0)), _mm256_loadu_ps(one(4)));
            let b = Self::both(_mm256_loadu_ps(one(1)), _mm256_loadu_ps(one(5)));
            let c = Self::both(_mm256_loadu_ps(one(2)), _mm256_loadu_ps(one(6)));
            let d = Self::both(_mm256_loadu_ps(one(3)), _mm256_loadu_ps(one(7)));
            [Self::three(a[0], b[0], c[0], d[0]), Self::three(a[1], b[1], c[1], d[1])]
        }
    }
}

impl F64x4 {
    /// Transposes 4 x 4 numbers.
    #[inline(always)]
    fn transpose([a, b, c, d]: [__m256d; 4]) -> [__m256d; 4] {
        unsafe {
            let (xz_ab, xz_cd) = (_mm256_unpacklo_pd(a, b), _mm256_unpacklo_pd(c, d));
            let (yw_ab, yw_cd) = (_mm256_unpackhi_pd(a, b), _mm256_unpackhi_pd(c, d));
            [
                _mm256_permute2f128_pd::<0x20>(xz_ab, xz_cd),
                _mm256_permute2f128_pd::<0x20>(yw_ab, yw_cd),
                _mm256_permute2f128_pd::<0x31>(xz_ab, xz_cd),
                _mm256_permute2f128_pd::<0x31>(yw_ab, yw_cd),
            ]
        }
    }

    /// The four components of quads 4 `part` and the next three.
    #[inline(always)]
    pub(super) fn columns(quads: &[[f64; 4]; LANES], part: usize) -> [Self; 4] {
        let [a, b, c, d] = &quads.as_chunks().0[part];
        let quads = unsafe {
            [
                _mm256_loadu_pd(a.as_ptr()),
                _mm256_loadu_pd(b.as_ptr()),
                _mm256_loadu_pd(c.as_ptr()),
                _mm256_loadu_pd(d.as_ptr()),
            ]
        };
        let [x, y, z, w] = Self::transpose(quads);
        [Self(x), Self(y), Self(z), Self(w)]
    }

    /// Writes quads 4 `part` and the next three from their components.
    #[inline(always)]
    pub(super) fn write_rows(columns: [__m256d; 4], part: usize, quads: &mut [[f64; 4]; LANES]) {
        let [a, b, c, d] = Self::transpose(columns);
        let quads: &mut [[f64; 4]; 4] = &mut quads.as_chunks_mut().0[part];
        unsafe {
            _mm256_storeu_pd(quads[0].as_mut_ptr(), a);
            _mm256_storeu_pd(quads[1].as_mut_ptr(), b);
            _mm256_storeu_pd(quads[2].as_mut_ptr(), c);
            _mm256_storeu_pd(quads[3].as_mut_ptr(), d);
        }
    }

    /// Components of one of the two vectors of four records.
    #[inline(always)]
    pub(super) unsafe fn gather_one(
        records: &[Record<f64>],
        vector: usize,
        indices: &[u16; LANES],
        part: usize,
    ) -> [Self; 3] {
        let indices: &[u16; 4] = &indices.as_chunks().0[part];
        // SAFETY: the caller promises indices in range; a record is two vectors of four numbers.
        unsafe {
            let one = |i: usize| records.as_ptr().add(indices[i] as usize).cast::<f64>().add(4 * vector);
            let (a, b) = (_mm256_loadu_pd(one(0)), _mm256_loadu_pd(one(1)));
            let (c, d) = (_mm256_loadu_pd(one(2)), _mm256_loadu_pd(one(3)));
            let (xz_ab, xz_cd) = (_mm256_unpacklo_pd(a, b), _mm256_unpacklo_pd(c, d));
            let (y_ab, y_cd) = (_mm256_unpackhi_pd(a, b), _mm256_unpackhi_pd(c, d));
            [
                Self(_mm256_permute2f128_pd::<0x20>(xz_ab, xz_cd)),
                Self(_mm256_permute2f128_pd::<0x20>(y_ab, y_cd)),
                Self(_mm256_permute2f128_pd::<0x31>(xz_ab, xz_cd)),
            ]
        }
    }
}

impl Lanes for F64x4 {
    type Number = f64;
    const PARTS: usize = 4;

    #[inline(always)]
    fn load_part(values: &[f64; LANES], part: usize) -> Self {
        let values: &[f64; 4] = &values.as_chunks().0[part];
        Self(unsafe { _mm256_loadu_pd(values.as_ptr()) })
    }

    #[inline(always)]
    fn store_part(self, values: &mut [f64; LANES], part: usize) {
        let values: &mut [f64; 4] = &mut values.as_chunks_mut().0[part];
        unsafe { _mm256_storeu_pd(values.as_mut_ptr(), self.0) };
    }

    #[inline(always)]
    unsafe fn gather_part(records: &[Record<f64>], indices: &[u16; LANES], part: usize) -> [[Self; 3]; 2] {
        // SAFETY: the caller promises indices in range.
        unsafe { [Self::gather_one(records, 0, indices, part), Self::gather_one(records, 1, indices, part)] }
    }
}
