//! Vectors of three binary64 numbers as plain arrays: geometry that is set up once, or is binary64
//! whatever the precision of the state.

/// a . b, added from the first product to the last.
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a x b.
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a - b.
pub fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| a[c] - b[c])
}

/// |a|.
pub fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}
