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

use self::cycle::LEAST_PIECE;
use crate::{
    math::{Real, Sixteen},
    parallel::{Own, per_block_mut, several_per_block, sum},
};

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
        let per_block = self.per_block();
        let all = Own::whole(vectors.products.len(), 1).in_pieces_of(LEAST_PIECE);
        let [r, z] = [&*restricted, change].map(|list| several_per_block(list, per_block));
        all.each((per_block_mut(&mut vectors.products), r, z), |_, (product, r, z)| {
            *product = products(r, z)
        });
        sum(&vectors.products)
    }

    /// z += P c of a block.
    pub(crate) fn prolong<R: Real>(&self, block: usize, change: &[Unknowns], z: &mut [Sixteen<R>]) {
        transfer::prolong(self.layout.basis(block, z.len()), change, z);
    }
}

/// The product of what a block has of two lists, and the sum of the magnitudes of its terms.
fn products(r: &[Unknowns], z: &[Unknowns]) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for (r, z) in r.iter().flatten().zip(z.iter().flatten()) {
        let product = r * z;
        sums = [sums[0] + product, sums[1] + product.abs()];
    }
    sums
}

#[cfg(test)]
mod tests;
