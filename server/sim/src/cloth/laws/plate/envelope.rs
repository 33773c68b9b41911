//! A small symmetric matrix and its Cholesky factor, kept by rows from their first entries on.

use crate::interrupt;

/// Least square of an entry on the diagonal of the factor, in entries of the matrix there.
const LEAST: f64 = 1e-12;

/// A symmetric positive definite matrix, or its factor.
pub(super) struct Envelope {
    /// Column of the first entry of each row.
    first: Vec<usize>,
    rows: Vec<Vec<f64>>,
}

impl Envelope {
    /// Zeros, from the column in each row from which on there are entries.
    pub(super) fn zeros(first: Vec<usize>) -> Self {
        let rows = first.iter().enumerate().map(|(row, first)| vec![0.0; row + 1 - first]).collect();
        Self { first, rows }
    }

    /// Adds to an entry below the diagonal or on it.
    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        self.rows[row][column - self.first[row]] += value;
    }

    /// Replaces the matrix by L of L Lᵀ; none where it is not positive definite, but for rounding.
    pub(super) fn factor(mut self) -> Option<Self> {
        for i in 0..self.rows.len() {
            interrupt::point();
            let (before, own) = self.rows.split_at_mut(i);
            let (row, start) = (&mut own[0], self.first[i]);
            for j in start..i {
                let (other, first) = (&before[j], self.first[j]);
                let from = first.max(start).min(j);
                let pairs = row[from - start..j - start].iter().zip(&other[from - first..]);
                let sum: f64 = pairs.map(|(a, b)| a * b).sum();
                row[j - start] = (row[j - start] - sum) / other[j - first];
            }
            let entry = row[i - start];
            let square = entry - row[..i - start].iter().map(|a| a * a).sum::<f64>();
            if !square.is_finite() || square <= LEAST * entry {
                return None;
            }
            row[i - start] = square.sqrt();
        }
        Some(self)
    }

    /// Solves L Lᵀ x = b for three right-hand sides, in their place.
    pub(super) fn solve(&self, b: &mut [[f64; 3]]) {
        for (i, (row, &start)) in self.rows.iter().zip(&self.first).enumerate() {
            for c in 0..3 {
                let known = row[..i - start].iter().zip(&b[start..i]);
                let sum: f64 = known.map(|(entry, b)| entry * b[c]).sum();
                b[i][c] = (b[i][c] - sum) / row[i - start];
            }
        }
        for (i, (row, &start)) in self.rows.iter().zip(&self.first).enumerate().rev() {
            for c in 0..3 {
                b[i][c] /= row[i - start];
                let found = b[i][c];
                for (entry, b) in row[..i - start].iter().zip(&mut b[start..i]) {
                    b[c] -= entry * found;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Envelope;

    #[test]
    fn a_factor_solves_what_its_matrix_multiplied() {
        let first = [0, 0, 1, 0, 2, 4, 3];
        let entry = |row: usize, column: usize| {
            let [row, column] = [row.max(column), row.min(column)];
            match row - column {
                0 => 9.0 + row as f64,
                _ if column >= first[row] => 1.0 / (1.0 + (row * 3 + column) as f64),
                _ => 0.0,
            }
        };
        let mut matrix = Envelope::zeros(first.to_vec());
        for row in 0..first.len() {
            for column in first[row]..=row {
                matrix.add(row, column, entry(row, column));
            }
        }
        let expected: Vec<[f64; 3]> = (0..7).map(|i| [1.0, f64::from(i), f64::from(i * i % 5)]).collect();
        let product = |row: usize| {
            let terms = |c: usize| (0..7).map(|column| entry(row, column) * expected[column][c]).sum::<f64>();
            [terms(0), terms(1), terms(2)]
        };
        let mut found: Vec<[f64; 3]> = (0..7).map(product).collect();
        matrix.factor().expect("a positive definite matrix").solve(&mut found);
        for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((found - expected).abs() < 1e-13, "{found}, {expected}");
        }
    }

    #[test]
    fn a_singular_matrix_has_no_factor() {
        let mut matrix = Envelope::zeros(vec![0, 0]);
        for [row, column] in [[0, 0], [1, 0], [1, 1]] {
            matrix.add(row, column, 2.0);
        }
        assert!(matrix.factor().is_none());
    }
}
