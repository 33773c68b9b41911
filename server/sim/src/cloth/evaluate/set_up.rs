//! Patches that are set up for the matrix of a step, and what they were made for: made again where that is not what a state keeps.

use super::{evaluation::Evaluation, numbers::StepNumbers, step_matrix::StepMatrix};
use crate::{
    cloth::{
        layout::{Model, Scratches},
        settings::Purpose,
        state::Kept,
    },
    interrupt::Interrupt,
    linalg::{Inverse3, MatrixParts, PatchLayout, PatchMatrix, PreconditionerKind},
    math::Real,
};

/// Functions and factors of patches.
#[derive(Debug, Default)]
pub(crate) struct SetUp<R: Real> {
    matrix: PatchMatrix,
    /// What they were made for.
    of: Kept<R>,
}

impl<R: Real> Clone for SetUp<R> {
    /// None: it is made for what its state keeps.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl<R: Real> SetUp<R> {
    pub(crate) fn matrix(&self) -> &PatchMatrix {
        &self.matrix
    }

    /// Lets the next solve make them again: what they were made for may have other parameters now.
    pub(crate) fn forget(&mut self) {
        self.of.forget();
    }

    /// Makes them of a matrix, whose inverse diagonal blocks these are; `kept` says what that is, if it is to be kept.
    pub(crate) fn make(
        &mut self,
        layout: &PatchLayout,
        matrix: &StepMatrix<'_, R>,
        inverse: &[Inverse3],
        kept: &Kept<R>,
    ) {
        self.matrix.set_up(layout, matrix, inverse);
        self.of.follow(kept);
        if matrix.is_given_up() {
            self.of.forget();
        }
    }

    /// Makes those that are kept, unless it has them: from an evaluation of its own, of the positions that they were made at,
    /// with numbers that they serve.
    pub(crate) fn make_again(
        &mut self,
        layout: &PatchLayout,
        (model, numbers): (&Model<R>, &StepNumbers<R>),
        kept: &Kept<R>,
        scratches: &Scratches<R>,
        interrupt: &Interrupt,
    ) {
        if self.of.is_made_as(kept) {
            return;
        }
        let (x, purpose) = (kept.positions(), Purpose::Iterate(PreconditionerKind::BlockJacobi));
        let mut evaluation = Evaluation::default();
        evaluation.size_for(model, purpose);
        // No velocity has a part in the matrix.
        evaluation.look(model, numbers, purpose, [x, x], scratches);
        let matrix = StepMatrix::new((model, numbers), x, &evaluation, scratches, interrupt);
        self.make(layout, &matrix, &evaluation.inverse, kept);
    }
}
