//! A triad, a = b + s c: what benchmarks compare the kernels of this library with, compiled as they are.

use super::each::{Own, per_row, per_row_mut};

/// Numbers that a thread takes at a time.
const BLOCK_SIZE: usize = 1 << 14;

/// a = b + s c by all threads; arrays of one length.
///
/// # Panics
/// When their lengths differ.
pub fn triad(a: &mut [f64], b: &[f64], s: f64, c: &[f64]) {
    assert!(a.len() == b.len() && b.len() == c.len(), "arrays of one length");
    let blocks = Own::whole(a.len(), BLOCK_SIZE);
    blocks.each((per_row_mut(a), per_row(b), per_row(c)), |_, (a, b, c)| {
        for (a, (b, c)) in a.iter_mut().zip(b.iter().zip(c)) {
            *a = b + s * c;
        }
    });
}

#[cfg(test)]
mod tests {
    use super::triad;

    #[test]
    fn every_element_is_written() {
        let numbers: Vec<f64> = (0..40_000).map(f64::from).collect();
        let mut a = vec![0.0; numbers.len()];
        triad(&mut a, &numbers, 3.0, &numbers);
        assert!(a.iter().zip(&numbers).all(|(a, b)| *a == 4.0 * b));
    }
}
