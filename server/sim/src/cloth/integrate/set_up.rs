//! What preconditioners of a step are set up with: the matrix on affine functions, or patches, which are kept as long as they serve.

use super::{
    at::{At, Guess},
    update::Step,
};
use crate::{
    cloth::{
        evaluate::{Evaluated, StepMatrix},
        state::State,
    },
    interrupt::Interrupt,
    linalg::{Outcome, PreconditionerKind, SolveReport, Stop},
    math::Real,
};

impl<R: Real> Step<'_, R> {
    /// Sets up what a preconditioner has on a coarse space, from the tangent as it is frozen; patches alone where those that
    /// are kept do not serve.
    pub(super) fn set_up(&mut self, at: At, kind: PreconditionerKind, interrupt: &Interrupt) {
        let (model, state) = (self.model, self.state);
        let State { x: iterate, kept, .. } = &mut *self.next;
        let Evaluated { evaluation, numbers, scratches, .. } = &*self.evaluated;
        let x = if at.is_iterate() { &*iterate } else { &state.x };
        let matrix = StepMatrix::new((model, numbers), x, evaluation, scratches, interrupt);
        self.solver.set_up(&matrix, &evaluation.inverse, kind, kept);
    }

    /// Iterations after which a solve goes on with patches that are set up for it; none where it has these, or ends by no
    /// tolerance, or by another than those before.
    pub(super) fn limit_of_kept(&self, at: At, stop: Stop) -> Option<u32> {
        let is_told = matches!(stop, Stop::Residual { .. }) && at != At::Balance;
        if is_told { self.next.kept.limit() } else { None }
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
        let kept = &mut self.next.kept;
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
