//! A preconditioner on two levels: inverse 3 x 3 blocks, and an inverse on a coarse space added to them.

use super::{
    coarse::{CoarseInverse, CoarseLayout, CoarseMatrix},
    operator::Preconditioner,
    precondition::{BlockJacobi, Inverse3},
};
use crate::math::{Real, Sixteen};

/// The inverse 3 x 3 blocks and, added to them, the inverse on a coarse space.
#[derive(Clone, Copy, Debug)]
pub struct TwoLevel<'a> {
    blocks: BlockJacobi<'a>,
    coarse: CoarseInverse<'a>,
}

impl<'a> TwoLevel<'a> {
    /// From the inverses of the diagonal blocks, and a coarse space with its matrix.
    pub fn new(inverse: &'a [Inverse3], layout: &'a CoarseLayout, matrix: &'a CoarseMatrix) -> Self {
        Self { blocks: BlockJacobi(inverse), coarse: CoarseInverse { layout, matrix } }
    }
}

impl<R: Real> Preconditioner<R> for TwoLevel<'_> {
    fn apply(&self, first_row: usize, r: &[Sixteen<R>], z: &mut [Sixteen<R>]) {
        self.blocks.apply(first_row, r, z);
    }

    fn advance(&self, first_row: usize, alpha: R, r: &mut [Sixteen<R>], q: &mut [Sixteen<R>]) -> [f64; 2] {
        self.blocks.advance(first_row, alpha, r, q)
    }

    fn coarse(&self) -> Option<CoarseInverse<'_>> {
        Some(self.coarse)
    }
}
