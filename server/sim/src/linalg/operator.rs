//! What a solver asks of a matrix and of an approximate inverse.

use rayon::prelude::*;

use crate::math::{Padded, Real, Vec3};

/// A square matrix of 3 x 3 blocks, applied block of rows by block of rows.
pub trait LinearOperator<R: Real>: Sync {
    /// Writes rows `first_row..first_row + out.len()` of A p.
    fn apply(&self, first_row: usize, p: &[Padded<R>], out: &mut [Vec3<R>]);

    /// Whether the solve is to be given up; asked before each iteration.
    fn is_interrupted(&self) -> bool {
        false
    }
}

/// A square matrix of 3 x 3 blocks, applied to a whole vector at once.
pub trait WholeOperator<R: Real> {
    /// Writes all of A x into `out`; what `out` held plays no part.
    fn apply(&mut self, x: &[Vec3<R>], out: &mut [Vec3<R>]);

    /// Whether the solve is to be given up; asked before each iteration.
    fn is_interrupted(&self) -> bool {
        false
    }
}

/// An approximate inverse, applied row by row.
pub trait Preconditioner<R: Real>: Sync {
    /// Writes rows `first_row..first_row + r.len()` of M⁻¹ r into `z`.
    fn apply(&self, first_row: usize, r: &[Vec3<R>], z: &mut [Vec3<R>]);
}

/// Copies vectors into a field that packs are gathered from, block by block.
pub(crate) fn pad<R: Real>(vectors: &[Vec3<R>], block_size: usize, field: &mut [Padded<R>]) {
    (field.par_chunks_mut(block_size), vectors.par_chunks(block_size)).into_par_iter().for_each(
        |(field, vectors)| {
            field.iter_mut().zip(vectors).for_each(|(field, vector)| *field = Padded::new(vector));
        },
    );
}
