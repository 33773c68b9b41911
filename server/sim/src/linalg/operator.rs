//! What a solver asks of a matrix and of an approximate inverse.

use super::{
    coarse::CoarseInverse,
    sixteens::{block_sums, subtract_scaled},
};
use crate::{
    math::{Padded, Real, Sixteen, Vec3},
    parallel::Share,
};

/// A square matrix of 3 x 3 blocks, applied block of rows by block of rows.
pub trait LinearOperator<R: Real>: Sync {
    /// Writes rows of A p from `first_row` on, a multiple of sixteen, and 0 beyond the last row of the matrix. Returns
    /// p.q over these rows, and the sum of `|p_c q_c|` over their components, q = A p.
    fn apply(&self, first_row: usize, p: &[Padded<R>], q: &mut [Sixteen<R>]) -> [f64; 2];

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

/// An approximate inverse: one that is applied row by row, and perhaps another that joins all of them.
pub trait Preconditioner<R: Real>: Sync {
    /// Writes rows of M⁻¹ r from `first_row` on, a multiple of sixteen.
    fn apply(&self, first_row: usize, r: &[Sixteen<R>], z: &mut [Sixteen<R>]);

    /// r -= alpha q, and M⁻¹ r in the place of q. Returns r.z over these rows, and the sum of `|r_c z_c|`.
    fn advance(&self, first_row: usize, alpha: R, r: &mut [Sixteen<R>], q: &mut [Sixteen<R>]) -> [f64; 2] {
        subtract_scaled(r, alpha, q);
        self.apply(first_row, r, q);
        block_sums(r, q)
    }

    /// What is added to it on a coarse space, if anything is.
    fn coarse(&self) -> Option<CoarseInverse<'_>> {
        None
    }

    /// What it is, where it is not applied row by row; nothing is added to it then.
    fn whole(&self) -> Option<&dyn WholePreconditioner<R>> {
        None
    }
}

/// Scratch vectors of a preconditioner that makes products with the matrix.
#[derive(Clone, Debug, Default)]
pub struct Room<R: Real> {
    /// What products are made with.
    pub(crate) z: Vec<Padded<R>>,
    /// What they come to.
    pub(crate) product: Vec<Sixteen<R>>,
}

/// An approximate inverse that products with the matrix are a part of, and that is applied to whole vectors.
pub trait WholePreconditioner<R: Real>: Sync {
    /// Writes z = M⁻¹ r in the blocks of a share, and of each r.z and the sum of `|r_c z_c|` over components. Returns how many
    /// products it made.
    fn apply(
        &self,
        a: &dyn LinearOperator<R>,
        share: &Share,
        r: &[Sixteen<R>],
        z: &mut [Sixteen<R>],
        partials: &mut [[f64; 2]],
        room: &mut Room<R>,
    ) -> u32;
}
