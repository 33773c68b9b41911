//! What preconditioners of a step are set up with: the matrix on affine functions, or patches, which are kept as long as they serve.

use super::{
    at::{At, Guess},
    update::Step,
};
use crate::{
    cloth::{
        evaluate::{StepMatrix, Workspace},
        layout::Model,
        state::State,
    },
    interrupt::Interrupt,
    linalg::{CoarseLayout, Outcome, PatchLayout, PreconditionerKind, SolveReport, Stop},
    math::Real,
};

impl<R: Real> Step<'_, R> {
    /// Sets up what a preconditioner has on a coarse space, from the tangent as it is frozen; patches alone where those that
    /// are kept do not serve.
    pub(super) fn set_up(&mut self, at: At, kind: PreconditionerKind, interrupt: &Interrupt) {
        let (model, state) = (self.model, self.state);
        let Workspace { evaluation, numbers, next, coarse, patches, scratches, .. } = &mut *self.work;
        let State { x: iterate, kept, .. } = next;
        let (evaluation, numbers, scratches) = (&*evaluation, &*numbers, &*scratches);
        let x = if at.is_iterate() { &*iterate } else { &state.x };
        let matrix = StepMatrix::new((model, numbers), x, evaluation, scratches, interrupt);
        if let Some(layout) = affine(model, kind) {
            coarse.fill(layout, &|block, blocks| matrix.project(layout, block, blocks));
        }
        let Some(layout) = soft(model, kind) else { return };
        let now = [numbers.scheme.h, numbers.mirror.to_f64()];
        if kept.serves(now) {
            patches.make_again(layout, (model, numbers), kept, scratches, interrupt);
            return;
        }
        // Of the air the matrix has a part that follows from velocities too.
        if numbers.external.air.is_empty() {
            kept.begin(x, now);
        } else {
            kept.forget();
        }
        patches.make(layout, &matrix, &evaluation.inverse, kept);
    }

    /// Iterations after which a solve goes on with patches that are set up for it; none where it has these, or ends by no
    /// tolerance, or by another than those before.
    pub(super) fn limit_of_kept(&self, at: At, stop: Stop) -> Option<u32> {
        let is_told = matches!(stop, Stop::Residual { .. }) && at != At::Balance;
        if is_told { self.work.next.kept.limit() } else { None }
    }

    /// Takes into account how a solve went with what is kept. Where solves end by no tolerance, iterations do not tell whether
    /// it serves, and where they went on without patches it is not needed. Those of a solve that began half done, and of one that ends by
    /// another tolerance, tell nothing.
    pub(super) fn note(
        &mut self,
        (at, guess): (At, Guess),
        kind: PreconditionerKind,
        report: &SolveReport,
        stop: Stop,
    ) {
        let kept = &mut self.work.next.kept;
        let is_told = kind == PreconditionerKind::Patches && matches!(stop, Stop::Residual { .. });
        match report.outcome {
            Outcome::Converged if is_told && at != At::Balance && guess != Guess::Here => {
                kept.note(report.iterations);
            }
            // Nothing is wrong with the preconditioner.
            Outcome::Converged | Outcome::NegativeCurvature { .. } | Outcome::ZeroCurvature { .. }
                if is_told =>
            {
                kept.pass();
            }
            _ => kept.forget(),
        }
    }
}

/// The affine functions of a preconditioner, if it has any.
pub(super) fn affine<R: Real>(model: &Model<R>, kind: PreconditionerKind) -> Option<&CoarseLayout> {
    model.coarse.as_ref().filter(|_| kind == PreconditionerKind::TwoLevel)
}

/// The patches of a preconditioner, if it has any.
pub(super) fn soft<R: Real>(model: &Model<R>, kind: PreconditionerKind) -> Option<&PatchLayout> {
    model.patches.as_ref().filter(|_| kind == PreconditionerKind::Patches)
}
