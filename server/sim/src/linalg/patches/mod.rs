//! A coarse space of small patches, each a particle and its ring, factored on a fixed tree. The functions of a patch are the
//! soft ones that an elimination of its own matrix leaves; their matrix is factored in binary32 by a multifrontal Cholesky
//! method, on a tree that is fixed when a body is built.
//!
//! Crumpled cloth has soft motions along every fold, as many as the borders of its parts are long: no few functions on large
//! parts hold them, which is where affine ones end. With D the diagonal blocks, B the inverse of Pᵀ A P and w = 1.4 / c, c
//! being how many rows a part of the matrix joins at most, z = M⁻¹ r is
//!
//! z = w D⁻¹ r; z += P B Pᵀ (r - A z); z += w D⁻¹ (r - A z).
//!
//! The eigenvalues of D⁻¹ A are c at most, so that w c < 2 makes this symmetric and positive definite, and those of M⁻¹ A
//! are above 0 and not above 1, with an exact B. Functions are kept in binary32, scaled to an energy of 1 each; vectors of
//! the particles have the precision of the state, and all bits depend on the body alone.

mod singles;
mod graph;
mod choose;
mod tree;
mod plan;
mod layout;
mod functions;
mod gather;
mod across;
mod dense;
mod sizes;
mod factor;
mod solve;
mod transfer;
mod matrix;
mod smooth;

pub(crate) use layout::{MatrixParts, TakeParts};
pub use layout::{PatchLayout, patch_bytes};
pub use matrix::PatchMatrix;

use self::smooth::{After, Before, Left};
use super::{
    operator::{LinearOperator, Preconditioner, Room, WholePreconditioner},
    precondition::{BlockJacobi, Inverse3},
    sixteens::pad,
};
use crate::{
    math::{LANES, Real, Sixteen, dispatch},
    parallel::{Share, per_block_mut, per_row_mut, per_sixteen, per_sixteen_mut, several_between_mut, size},
};

/// The preconditioner: the inverse 3 x 3 blocks, the patches, the blocks again.
#[derive(Clone, Copy, Debug)]
pub struct Patches<'a> {
    inverse: &'a [Inverse3],
    layout: &'a PatchLayout,
    matrix: &'a PatchMatrix,
}

impl<'a> Patches<'a> {
    /// From the inverses of the diagonal blocks, and patches that were set up for the same matrix.
    pub fn new(inverse: &'a [Inverse3], layout: &'a PatchLayout, matrix: &'a PatchMatrix) -> Self {
        Self { inverse, layout, matrix }
    }

    /// The inverses of the diagonal blocks from a row on.
    fn inverse(&self, first_row: usize) -> &'a [Inverse3] {
        &self.inverse[first_row / LANES..]
    }
}

impl<R: Real> Preconditioner<R> for Patches<'_> {
    /// The inverse blocks alone, which is what it does row by row.
    fn apply(&self, first_row: usize, r: &[Sixteen<R>], z: &mut [Sixteen<R>]) {
        BlockJacobi(self.inverse).apply(first_row, r, z);
    }

    fn whole(&self) -> Option<&dyn WholePreconditioner<R>> {
        Some(self)
    }
}

impl<R: Real> WholePreconditioner<R> for Patches<'_> {
    fn apply(
        &self,
        a: &dyn LinearOperator<R>,
        share: &Share,
        r: &[Sixteen<R>],
        z: &mut [Sixteen<R>],
        partials: &mut [[f64; 2]],
        room: &mut Room<R>,
    ) -> u32 {
        let Self { layout, matrix, .. } = *self;
        let (own, block_size) = (share.own(), share.block_size());
        let damping = R::of(layout.damping);
        let Room { z: padded, product } = room;
        size(padded, r.len() * LANES);
        size(product, r.len());

        let fields = (per_sixteen(r), per_sixteen_mut(z), per_row_mut(padded));
        own.each(fields, |block, (r, z, p)| {
            let inverse = self.inverse(block * block_size);
            dispatch(Before { inverse, damping, r, z, p });
        });

        let known = &padded[..];
        let vectors = &mut *matrix.vectors();
        let unknowns = several_between_mut(&mut vectors.b, matrix.block_starts(), 1);
        let fields = (per_sixteen(r), per_sixteen_mut(product), unknowns);
        own.each(fields, |block, (r, product, unknowns)| {
            a.apply(block * block_size, known, product);
            dispatch(Left { r, product: &mut *product });
            matrix.restrict((layout, block), product, unknowns);
        });
        matrix.solve(layout, vectors);

        let vectors = &*vectors;
        own.each((per_sixteen_mut(z), per_row_mut(padded)), |block, (z, p)| {
            matrix.prolong((layout, block), vectors, z);
            pad(z, p);
        });
        let known = &padded[..];
        let fields = (per_sixteen(r), per_sixteen_mut(z), per_sixteen_mut(product), per_block_mut(partials));
        own.each(fields, |block, (r, z, product, partial)| {
            a.apply(block * block_size, known, product);
            let inverse = self.inverse(block * block_size);
            *partial = dispatch(After { inverse, damping, r, product, z });
        });
        2
    }
}

#[cfg(test)]
mod tests;
