//! A coarse space: affine functions on aggregates of rows, and an approximate inverse of a matrix on them. On each
//! aggregate they are the affine functions of where its rows begin, three components times 1, u and v. Aggregates are
//! blocks of rows, or parts of a block that is folded or falls apart. The approximate inverse of the matrix on this
//! space is added to one that acts row by row, so that an iteration carries over the whole body what conjugate gradient
//! by itself carries from row to row.
//!
//! The matrix Pᵀ A P has nine unknowns per aggregate. It is inverted approximately by one V-cycle: levels of aggregates
//! made of about four neighbours of the level before, affine functions again, until few enough remain to be factored
//! (Vanek, Mandel and Brezina 1996, without their smoothing of the functions). The functions are kept in binary32, Pᵀ r of a
//! block and what P adds to its rows are computed in the precision of r, and all else is binary64.

mod affine;
mod nine;
mod transfer;
mod group;
mod parts;
mod layout;
mod dense;
mod cycle;
mod matrix;

pub use layout::CoarseLayout;
pub use matrix::CoarseMatrix;

pub(crate) use cycle::CoarseVectors;
pub(crate) use nine::{NineByNine, Unknowns};

use crate::math::{Real, Sixteen};

/// The approximate inverse on a coarse space.
#[derive(Clone, Copy, Debug)]
pub struct CoarseInverse<'a> {
    pub(super) layout: &'a CoarseLayout,
    pub(super) matrix: &'a CoarseMatrix,
}

impl CoarseInverse<'_> {
    /// Makes room for the vectors of a solve.
    pub(crate) fn make_room(&self, vectors: &mut CoarseVectors) {
        vectors.size_for(self.layout);
    }

    /// Aggregates of each block.
    pub(crate) fn per_block(&self) -> usize {
        self.layout.per_block()
    }

    /// Pᵀ r of a block.
    pub(crate) fn restrict<R: Real>(&self, block: usize, r: &[Sixteen<R>], to: &mut [Unknowns]) {
        transfer::restrict(self.layout.basis(block, r.len()), r, to);
    }

    /// From restricted residuals to the change that they call for. Returns their product, and the sum of the magnitudes
    /// of its terms.
    pub(crate) fn solve(
        &self,
        restricted: &[Unknowns],
        change: &mut [Unknowns],
        vectors: &mut CoarseVectors,
    ) -> [f64; 2] {
        self.matrix.solve(self.layout, restricted, change, vectors);
        let (mut signed, mut magnitude) = (0.0, 0.0);
        for (r, z) in restricted.iter().flatten().zip(change.iter().flatten()) {
            signed += r * z;
            magnitude += (r * z).abs();
        }
        [signed, magnitude]
    }

    /// z += P c of a block.
    pub(crate) fn prolong<R: Real>(&self, block: usize, change: &[Unknowns], z: &mut [Sixteen<R>]) {
        transfer::prolong(self.layout.basis(block, z.len()), change, z);
    }
}

#[cfg(test)]
mod tests;
