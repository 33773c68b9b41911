//! Vectors of three numbers as plain arrays: binary64 for geometry that is set up once, packs of lanes in
//! the kernels.

use std::ops::{Add, Mul, Sub};

/// The array of `expression` for c = 0, 1, 2. In kernels it stands for `map`, whose closure a compiler may keep as a
/// function of its own, which then lacks the instructions that the kernel is compiled for.
macro_rules! three {
    (|$c:ident| $expression:expr) => {
        [
            {
                let $c = 0_usize;
                $expression
            },
            {
                let $c = 1_usize;
                $expression
            },
            {
                let $c = 2_usize;
                $expression
            },
        ]
    };
}
pub(crate) use three;

/// a . b, added from the first product to the last.
#[inline(always)]
pub fn dot<T: Copy + Add<Output = T> + Mul<Output = T>>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a x b.
#[inline(always)]
pub fn cross<T: Copy + Sub<Output = T> + Mul<Output = T>>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a - b.
#[inline(always)]
pub fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// |a|.
#[inline(always)]
pub fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}
