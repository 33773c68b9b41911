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
mod level;
mod division;
mod layout;
mod dense;
mod cycle;
mod matrix;

pub use layout::CoarseLayout;
pub use matrix::CoarseMatrix;

pub(crate) use cycle::CoarseVectors;
pub(crate) use nine::{NineByNine, Unknowns};

use self::level::LEAST_PIECE;
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

    /// From restricted residuals, of which own ones are filled in, to the change that they call for, on own aggregates. Returns
    /// the sum of `partials`, one per block of rows, of which own ones are filled in too; and the product of residuals and
    /// change, with the sum of the magnitudes of its terms.
    pub(crate) fn solve(
        &self,
        partials: &[[f64; 2]],
        restricted: &mut [Unknowns],
        change: &mut [Unknowns],
        vectors: &mut CoarseVectors,
    ) -> [[f64; 2]; 2] {
        let Self { layout, matrix } = *self;
        let (share, cycle, of_rank) =
            (&layout.share, matrix.cycle(layout), |rank| layout.aggregates_of(rank));
        let of_rows = |list: &mut [Unknowns]| share.sum_and_complete(partials, &|part| *part, list, of_rank);
        if let Some(division) = layout.division.as_deref() {
            share.exchange_over(&division.aggregates, [&mut *restricted]);
            let (reach, mut sum) = (layout.reach(), [0.0; 2]);
            cycle.run_divided(&reach, restricted, change, vectors, |r| sum = of_rows(r));
            self.multiply(share.own(), restricted, change, vectors);
            return [sum, share.sum(&vectors.products, &|product| *product)];
        }
        let sum_of_rows = of_rows(restricted);
        cycle.run(restricted, change, vectors);
        let all = Own::whole(vectors.products.len(), 1);
        self.multiply(all.in_pieces_of(LEAST_PIECE), restricted, change, vectors);
        [sum_of_rows, sum(&vectors.products)]
    }

    /// Multiplies what blocks of rows have of two lists.
    fn multiply(&self, blocks: Own, r: &[Unknowns], z: &[Unknowns], vectors: &mut CoarseVectors) {
        let [r, z] = [r, z].map(|list| several_per_block(list, self.per_block()));
        blocks.each((per_block_mut(&mut vectors.products), r, z), |_, (product, r, z)| {
            *product = products(r, z);
        });
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
