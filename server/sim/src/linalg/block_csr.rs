//! A sparse matrix of 3 x 3 blocks, rows in parallel: the reference for matrix-free products
//! (the `MatAdj` of Zara 2001, section 5.2).

use super::{operator::LinearOperator, rows::fill_rows, sixteens::sums_of_padded};
use crate::math::{LANES, Mat3, Padded, Real, Sixteen, Vec3};

/// Compressed rows of 3 x 3 blocks. Columns ascend within a row; the diagonal is stored.
#[derive(Clone, Debug, Default)]
pub struct BlockCsr<R: Real> {
    starts: Vec<usize>,
    columns: Vec<u32>,
    blocks: Vec<Mat3<R>>,
}

/// Rows that a thread takes, at least.
const LEAST_PIECE: usize = 128;

impl<R: Real> BlockCsr<R> {
    /// An empty matrix with room for these columns in each row (the diagonal is added).
    pub fn with_pattern(rows: impl Iterator<Item = Vec<u32>>) -> Self {
        let (mut starts, mut columns) = (vec![0], Vec::new());
        for (i, mut row) in rows.enumerate() {
            row.push(i as u32);
            row.sort_unstable();
            row.dedup();
            columns.extend(row);
            starts.push(columns.len());
        }

        let blocks = vec![Mat3::zeros(); columns.len()];
        Self { starts, columns, blocks }
    }

    /// Blocks of a dense matrix of 3n x 3n numbers given by rows; zero blocks are left out.
    ///
    /// # Panics
    /// Unless the matrix is square and its size a multiple of 3.
    pub fn from_dense(rows: &[Vec<f64>]) -> Self {
        assert!(rows.len().is_multiple_of(3) && rows.iter().all(|row| row.len() == rows.len()), "square, 3n");
        let count = rows.len() / 3;
        let block = |i: usize, j: usize| Mat3::from_fn(|a, b| R::of(rows[3 * i + a][3 * j + b]));
        let mut matrix = Self::with_pattern(
            (0..count)
                .map(|i| (0..count as u32).filter(|&j| block(i, j as usize) != Mat3::zeros()).collect()),
        );

        for i in 0..count {
            for k in matrix.starts[i]..matrix.starts[i + 1] {
                matrix.blocks[k] = block(i, matrix.columns[k] as usize);
            }
        }
        matrix
    }

    /// Number of block rows.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether it has no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of stored blocks.
    pub fn block_count(&self) -> usize {
        self.blocks.len()
    }

    /// Fills every row, in parallel: `fill(row, columns, blocks)`.
    pub(crate) fn fill_rows(&mut self, fill: &(impl Fn(usize, &[u32], &mut [Mat3<R>]) + Sync)) {
        fill_rows(0..self.len(), &self.starts, &self.columns, &mut self.blocks, LEAST_PIECE, fill);
    }
}

impl<R: Real> LinearOperator<R> for BlockCsr<R> {
    fn apply(&self, first_row: usize, p: &[Padded<R>], q: &mut [Sixteen<R>]) -> [f64; 2] {
        for (group, q) in q.iter_mut().enumerate() {
            *q = Sixteen::default();
            let first = first_row + group * LANES;
            for i in first..(first + LANES).min(self.len()) {
                let row = self.starts[i]..self.starts[i + 1];
                let mut sum = Vec3::zeros();
                for (block, &column) in self.blocks[row.clone()].iter().zip(&self.columns[row]) {
                    sum += block * p[column as usize].vector();
                }
                q.set(i - first, sum);
            }
        }
        sums_of_padded(&p[first_row..first_row + q.len() * LANES], q)
    }
}
