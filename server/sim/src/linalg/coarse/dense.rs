//! A dense symmetric matrix, factored as L D Lᵀ.

use super::nine::SMALLEST_PIVOT;
use crate::math::{Pack, WithSimd, dispatch};

/// Factors of a symmetric matrix. Unknowns without a positive pivot are left at 0, so that what is solved is positive
/// definite.
#[derive(Clone, Debug, Default)]
pub(super) struct Dense {
    size: usize,
    /// By rows; after factoring L, and Lᵀ in the upper half, so that every sweep reads rows.
    entries: Vec<f64>,
    /// 1 / D, or 0.
    inverse_pivots: Vec<f64>,
}

impl Dense {
    /// Makes room for so many unknowns; every entry is then 0.
    pub(super) fn clear(&mut self, size: usize) {
        self.size = size;
        self.entries.clear();
        self.entries.resize(size * size, 0.0);
        self.inverse_pivots.resize(size, 0.0);
    }

    /// The entry of a row and a column, of which only those with row <= column are read.
    pub(super) fn entry(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.entries[row * self.size + column]
    }

    /// Factors it in its place.
    pub(super) fn factor(&mut self) {
        dispatch::<f64, _>(Factor(self));
    }

    /// From a right-hand side to the solution.
    pub(super) fn solve(&self, x: &mut [f64]) {
        dispatch::<f64, _>(Solve(self, x));
    }
}

struct Factor<'a>(&'a mut Dense);

impl WithSimd<f64> for Factor<'_> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = f64>>(self) {
        let Dense { size, entries, inverse_pivots } = self.0;
        let size = *size;
        for j in 0..size {
            inverse_pivots[j] = entries[j * size + j];
        }
        for j in 0..size {
            let (above, below) = entries.split_at_mut((j + 1) * size);
            let row = &mut above[j * size..];
            let (pivot, diagonal) = (row[j], inverse_pivots[j]);
            let is_kept = pivot > SMALLEST_PIVOT * diagonal && pivot.is_finite();
            let inverse = if is_kept { 1.0 / pivot } else { 0.0 };
            inverse_pivots[j] = inverse;
            for (k, other) in (j + 1..size).zip(below.chunks_exact_mut(size)) {
                let factor = row[k] * inverse;
                other[j] = factor;
                if factor != 0.0 {
                    for (entry, above) in other[k..].iter_mut().zip(&row[k..]) {
                        *entry -= factor * above;
                    }
                }
            }
            for entry in &mut row[j + 1..] {
                *entry *= inverse;
            }
        }
    }
}

struct Solve<'a>(&'a Dense, &'a mut [f64]);

impl WithSimd<f64> for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = f64>>(self) {
        let (Dense { size, entries, inverse_pivots }, x) = (self.0, self.1);
        for j in 0..*size {
            let row = &entries[j * size..(j + 1) * size];
            // An unknown that is left out takes no part.
            let known = if inverse_pivots[j] > 0.0 { x[j] } else { 0.0 };
            for (x, entry) in x[j + 1..].iter_mut().zip(&row[j + 1..]) {
                *x -= known * entry;
            }
            x[j] = known * inverse_pivots[j];
        }
        for j in (0..*size).rev() {
            let row = &entries[j * size..(j + 1) * size];
            let known = x[j];
            for (x, entry) in x[..j].iter_mut().zip(row) {
                *x -= known * entry;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Dense;

    fn matrix(size: usize, entry: impl Fn(usize, usize) -> f64) -> Dense {
        let mut dense = Dense::default();
        dense.clear(size);
        for row in 0..size {
            for column in row..size {
                *dense.entry(row, column) = entry(row, column);
            }
        }
        dense.factor();
        dense
    }

    #[test]
    fn a_factored_matrix_solves_what_it_was() {
        let entry = |i: usize, j: usize| {
            1.0 / (1.0 + i.abs_diff(j) as f64) + if i == j { 2.0 + (i % 3) as f64 } else { 0.0 }
        };
        let dense = matrix(40, entry);
        let solution: Vec<f64> = (0..40).map(|i| (f64::from(i) * 0.7 - 3.0) % 2.0).collect();
        let mut x: Vec<f64> = (0..40).map(|i| (0..40).map(|j| entry(i, j) * solution[j]).sum()).collect();
        dense.solve(&mut x);
        let error = x.iter().zip(&solution).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-13, "{error:e}");
    }

    #[test]
    fn an_unknown_without_a_positive_pivot_stays_0_and_the_others_are_solved_without_it() {
        for bad in [0.0, -3.0, 1.0, f64::NAN] {
            // The second row is that of the first where its diagonal entry is 1.
            let dense = matrix(3, |i, j| match (i, j) {
                (1, 1) => bad,
                (0, 0 | 1) => 1.0,
                (2, 2) => 4.0,
                _ => 0.0,
            });
            let mut x = [3.0, 5.0, 8.0];
            dense.solve(&mut x);
            assert_eq!(x, [3.0, 0.0, 2.0], "{bad}");
        }
    }
}
