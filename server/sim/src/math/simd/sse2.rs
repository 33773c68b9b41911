//! Packs in 128-bit registers, which every x86-64 has: four for binary32, eight for binary64.
//!
//! Arrays of numbers would do, and do so on other targets; but a compiler takes them apart into sixteen numbers and puts
//! them together again, which made every build longer.
//!
//! SAFETY of the whole file: the instructions are the target's baseline; nothing else makes these
//! intrinsics unsafe but pointers, which carry their own comment.
#![allow(unsafe_code, reason = "intrinsics")]
#![allow(clippy::undocumented_unsafe_blocks, reason = "stated once at the top of the file")]

#[allow(clippy::wildcard_imports, reason = "the list would be as long as the file")]
use std::arch::x86_64::*;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use super::{
    super::real::{LANES, Pack, Record},
    operators::operators,
    portable::Portable,
};

#[derive(Clone, Copy)]
pub(crate) struct F32x16([__m128; 4]);

#[derive(Clone, Copy)]
pub(crate) struct F64x16([__m128d; 8]);

/// Applies an instruction register by register.
macro_rules! each {
    ($pack:ident, $instruction:ident($a:ident, $b:ident), [$($i:literal)+]) => {
        $pack(unsafe { [$($instruction($a.0[$i], $b.0[$i])),+] })
    };
}

operators! {
    [] F32x16, f32;
    |a, b|
    + each!(F32x16, _mm_add_ps(a, b), [0 1 2 3]),
    - each!(F32x16, _mm_sub_ps(a, b), [0 1 2 3]),
    * each!(F32x16, _mm_mul_ps(a, b), [0 1 2 3]),
    / each!(F32x16, _mm_div_ps(a, b), [0 1 2 3])
}

operators! {
    [] F64x16, f64;
    |a, b|
    + each!(F64x16, _mm_add_pd(a, b), [0 1 2 3 4 5 6 7]),
    - each!(F64x16, _mm_sub_pd(a, b), [0 1 2 3 4 5 6 7]),
    * each!(F64x16, _mm_mul_pd(a, b), [0 1 2 3 4 5 6 7]),
    / each!(F64x16, _mm_div_pd(a, b), [0 1 2 3 4 5 6 7])
}

/// The operations that are the same for both precisions but for their intrinsics.
macro_rules! lanewise {
    ($number:ty, $registers:literal [$($i:literal)+], $splat:ident, $load:ident, $store:ident,
     $div:ident, $sqrt:ident, $max:ident, $min:ident, $and:ident, $andnot:ident, $or:ident,
     $greater:ident, $to_bits:ident, $from_bits:ident, $shift:ident::<$significand:literal>, $add_bits:ident) => {
        type Number = $number;
        type Wide = F64x16;

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
        fn min(self, other: Self) -> Self {
            Self(unsafe { [$($min(self.0[$i], other.0[$i])),+] })
        }
        #[inline(always)]
        fn inverse_or_zero(self) -> Self {
            let inverse = Self(unsafe { [$($div($splat(1.0), self.0[$i])),+] });
            inverse.where_positive(self)
        }
        #[inline(always)]
        fn where_positive(self, gate: Self) -> Self {
            Self(unsafe { [$($and($greater(gate.0[$i], $splat(0.0)), self.0[$i])),+] })
        }
        #[inline(always)]
        fn if_less(self, other: Self, then: Self, otherwise: Self) -> Self {
            Self(unsafe {
                [$({
                    let is_less = $greater(other.0[$i], self.0[$i]);
                    $or($and(is_less, then.0[$i]), $andnot(is_less, otherwise.0[$i]))
                }),+]
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

        /// Lane by lane: the instruction came with SSE4.1.
        #[inline(always)]
        fn floor(self) -> Self {
            Self::load(&self.store().map(<$number>::floor))
        }
    };
}

/// Transposes 4 x 4 numbers.
#[inline(always)]
fn transpose([a, b, c, d]: [__m128; 4]) -> [__m128; 4] {
    unsafe {
        let (ab_low, cd_low) = (_mm_unpacklo_ps(a, b), _mm_unpacklo_ps(c, d));
        let (ab_high, cd_high) = (_mm_unpackhi_ps(a, b), _mm_unpackhi_ps(c, d));
        [
            _mm_movelh_ps(ab_low, cd_low),
            _mm_movehl_ps(cd_low, ab_low),
            _mm_movelh_ps(ab_high, cd_high),
            _mm_movehl_ps(cd_high, ab_high),
        ]
    }
}

/// Row i of four packs to register i of each: `of(i)` transposed.
#[inline(always)]
fn four(of: impl Fn(usize) -> [__m128; 4]) -> [F32x16; 4] {
    let [a, b, c, d] = [transpose(of(0)), transpose(of(1)), transpose(of(2)), transpose(of(3))];
    [0, 1, 2, 3].map(|column| F32x16([a[column], b[column], c[column], d[column]]))
}

impl Pack for F32x16 {
    lanewise!(
        f32,
        4 [0 1 2 3],
        _mm_set1_ps,
        _mm_loadu_ps,
        _mm_storeu_ps,
        _mm_div_ps,
        _mm_sqrt_ps,
        _mm_max_ps,
        _mm_min_ps,
        _mm_and_ps,
        _mm_andnot_ps,
        _mm_or_ps,
        _mm_cmpgt_ps,
        _mm_castps_si128,
        _mm_castsi128_ps,
        _mm_slli_epi32::<23>,
        _mm_add_epi32
    );

    #[inline(always)]
    fn whole(self) -> [u16; LANES] {
        let mut whole = [0_i32; LANES];
        // SAFETY: register i holds four numbers of the array.
        unsafe {
            for i in 0..4 {
                _mm_storeu_si128(whole.as_mut_ptr().add(4 * i).cast(), _mm_cvtps_epi32(self.0[i]));
            }
        }
        whole.map(|number| number as u16)
    }

    #[inline(always)]
    fn widen(self) -> F64x16 {
        let [a, b, c, d] = self.0;
        unsafe {
            F64x16([
                _mm_cvtps_pd(a),
                _mm_cvtps_pd(_mm_movehl_ps(a, a)),
                _mm_cvtps_pd(b),
                _mm_cvtps_pd(_mm_movehl_ps(b, b)),
                _mm_cvtps_pd(c),
                _mm_cvtps_pd(_mm_movehl_ps(c, c)),
                _mm_cvtps_pd(d),
                _mm_cvtps_pd(_mm_movehl_ps(d, d)),
            ])
        }
    }

    #[inline(always)]
    unsafe fn gather(records: &[Record<f32>], indices: &[u16; LANES]) -> [[Self; 3]; 2] {
        // SAFETY: the caller promises indices in range; a record is two vectors of four numbers.
        let one = |vector: usize, i: usize| unsafe {
            _mm_loadu_ps(records.as_ptr().add(indices[i] as usize).cast::<f32>().add(4 * vector))
        };
        let of = |vector: usize| {
            let quads = |i: usize| {
                [one(vector, 4 * i), one(vector, 4 * i + 1), one(vector, 4 * i + 2), one(vector, 4 * i + 3)]
            };
            let [x, y, z, _] = four(quads);
            [x, y, z]
        };
        [of(0), of(1)]
    }

    #[inline(always)]
    fn repeat(quad: &[f32; 4]) -> Self {
        Self([unsafe { _mm_loadu_ps(quad.as_ptr()) }; 4])
    }
    #[inline(always)]
    fn spread(quad: &[f32; 4]) -> Self {
        unsafe {
            Self([_mm_set1_ps(quad[0]), _mm_set1_ps(quad[1]), _mm_set1_ps(quad[2]), _mm_set1_ps(quad[3])])
        }
    }
    #[inline(always)]
    fn fold(self) -> [f32; 4] {
        let [a, b, c, d] = self.0;
        let mut sums = [0.0; 4];
        unsafe { _mm_storeu_ps(sums.as_mut_ptr(), _mm_add_ps(_mm_add_ps(a, c), _mm_add_ps(b, d))) };
        sums
    }
    #[inline(always)]
    fn columns(quads: &[[f32; 4]; LANES]) -> [Self; 4] {
        let one = |i: usize| unsafe { _mm_loadu_ps(quads[i].as_ptr()) };
        four(|i| [one(4 * i), one(4 * i + 1), one(4 * i + 2), one(4 * i + 3)])
    }
    #[inline(always)]
    fn rows([a, b, c, d]: [Self; 4]) -> [[f32; 4]; LANES] {
        let mut quads = [[0.0; 4]; LANES];
        for i in 0..4 {
            let rows = transpose([a.0[i], b.0[i], c.0[i], d.0[i]]);
            for k in 0..4 {
                unsafe { _mm_storeu_ps(quads[4 * i + k].as_mut_ptr(), rows[k]) };
            }
        }
        quads
    }
}

impl F64x16 {
    /// Four columns of two quads, from where each of their halves stands.
    #[inline(always)]
    fn two([a, b]: [[__m128d; 2]; 2]) -> [__m128d; 4] {
        unsafe {
            [
                _mm_unpacklo_pd(a[0], b[0]),
                _mm_unpackhi_pd(a[0], b[0]),
                _mm_unpacklo_pd(a[1], b[1]),
                _mm_unpackhi_pd(a[1], b[1]),
            ]
        }
    }

    /// Columns of sixteen quads, which `halves` loads.
    #[inline(always)]
    fn columns_of(halves: impl Fn(usize) -> [__m128d; 2]) -> [Self; 4] {
        let mut columns = [[unsafe { _mm_set1_pd(0.0) }; 8]; 4];
        for i in 0..8 {
            let pair = Self::two([halves(2 * i), halves(2 * i + 1)]);
            for c in 0..4 {
                columns[c][i] = pair[c];
            }
        }
        columns.map(Self)
    }
}

impl Pack for F64x16 {
    lanewise!(
        f64,
        8 [0 1 2 3 4 5 6 7],
        _mm_set1_pd,
        _mm_loadu_pd,
        _mm_storeu_pd,
        _mm_div_pd,
        _mm_sqrt_pd,
        _mm_max_pd,
        _mm_min_pd,
        _mm_and_pd,
        _mm_andnot_pd,
        _mm_or_pd,
        _mm_cmpgt_pd,
        _mm_castpd_si128,
        _mm_castsi128_pd,
        _mm_slli_epi64::<52>,
        _mm_add_epi64
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
    unsafe fn gather(records: &[Record<f64>], indices: &[u16; LANES]) -> [[Self; 3]; 2] {
        let of = |vector: usize| {
            let [x, y, z, _] = Self::columns_of(|i| {
                // SAFETY: the caller promises indices in range; a record is two vectors of four numbers.
                unsafe {
                    let one = records.as_ptr().add(indices[i] as usize).cast::<f64>().add(4 * vector);
                    [_mm_loadu_pd(one), _mm_loadu_pd(one.add(2))]
                }
            });
            [x, y, z]
        };
        [of(0), of(1)]
    }

    #[inline(always)]
    fn repeat(quad: &[f64; 4]) -> Self {
        let [low, high] = unsafe { [_mm_loadu_pd(quad.as_ptr()), _mm_loadu_pd(quad.as_ptr().add(2))] };
        Self([low, high, low, high, low, high, low, high])
    }
    #[inline(always)]
    fn spread(quad: &[f64; 4]) -> Self {
        let [a, b, c, d] = quad.map(|number| unsafe { _mm_set1_pd(number) });
        Self([a, a, b, b, c, c, d, d])
    }
    #[inline(always)]
    fn fold(self) -> [f64; 4] {
        let mut sums = [0.0; 4];
        // SAFETY: two numbers at 0 and at 2.
        unsafe {
            for half in 0..2 {
                let [a, b, c, d] = [0, 2, 4, 6].map(|quad| self.0[quad + half]);
                let sum = _mm_add_pd(_mm_add_pd(a, c), _mm_add_pd(b, d));
                _mm_storeu_pd(sums.as_mut_ptr().add(2 * half), sum);
            }
        }
        sums
    }
    #[inline(always)]
    fn columns(quads: &[[f64; 4]; LANES]) -> [Self; 4] {
        // SAFETY: two numbers at 0 and at 2 of a quad.
        Self::columns_of(|i| unsafe {
            [_mm_loadu_pd(quads[i].as_ptr()), _mm_loadu_pd(quads[i].as_ptr().add(2))]
        })
    }
    #[inline(always)]
    fn rows([a, b, c, d]: [Self; 4]) -> [[f64; 4]; LANES] {
        let mut quads = [[0.0; 4]; LANES];
        for i in 0..8 {
            // Transposing pairs of halves is its own inverse.
            let [low, high] = [[a.0[i], b.0[i]], [c.0[i], d.0[i]]];
            // SAFETY: two numbers at 0 and at 2 of a quad.
            unsafe {
                for (k, [left, right]) in [
                    [_mm_unpacklo_pd(low[0], low[1]), _mm_unpacklo_pd(high[0], high[1])],
                    [_mm_unpackhi_pd(low[0], low[1]), _mm_unpackhi_pd(high[0], high[1])],
                ]
                .into_iter()
                .enumerate()
                {
                    _mm_storeu_pd(quads[2 * i + k].as_mut_ptr(), left);
                    _mm_storeu_pd(quads[2 * i + k].as_mut_ptr().add(2), right);
                }
            }
        }
        quads
    }
}
