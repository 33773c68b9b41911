//! The linear solve of an implicit step, with the matrix and right-hand side that an evaluation made.

use super::update::Step;
use crate::{
    cloth::{
        evaluate::{StepMatrix, Workspace, pattern},
        settings::ClothSettings,
    },
    interrupt::Interrupt,
    linalg::{
        BlockJacobi, Identity, LinearOperator, OperatorKind, Outcome, Preconditioner, PreconditionerKind,
        SolveReport, SolverSettings, TwoLevel, conjugate_gradient,
    },
    math::{Padded, Real, Sixteen},
    report::{Stage, StepFailure},
};

/// Which state was evaluated.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum At {
    /// That at the start of the step: its solve may start from that of the step before.
    State,
    /// The iterate in the workspace's `next`.
    Iterate,
}

impl<R: Real> Step<'_, R> {
    /// Solves for the change of velocity, into the `dv` of the next state.
    pub(super) fn solve(&mut self, at: At, settings: &ClothSettings, interrupt: &Interrupt) -> SolveReport {
        let (model, state) = (self.model, self.state);
        let common = self.take_common_part();
        let warm_start = at == At::State && settings.solver.warm_start;
        let solver = &SolverSettings { warm_start, ..settings.solver };
        let Workspace { evaluation, numbers, next, assembled, coarse, cg, scratches, .. } = &mut *self.work;
        let groups = evaluation.rows.len();
        next.dv.resize(groups, Sixteen::default());
        let begin = |dv: &mut [Sixteen<R>]| {
            if warm_start && state.dv.len() == groups {
                dv.copy_from_slice(&state.dv);
                if let Some(common) = &common {
                    common.take_off(model, dv);
                }
            } else {
                dv.fill(Sixteen::default());
            }
        };
        begin(&mut next.dv);

        let numbers = &*numbers;
        let x = if at == At::State { &state.x } else { &next.x };
        let matrix = StepMatrix::new((model, numbers), x, evaluation, scratches, interrupt);
        let stored;
        let operator: &dyn LinearOperator<R> = match solver.operator {
            OperatorKind::MatrixFree => &matrix,
            OperatorKind::Assembled => {
                let room = assembled.get_or_insert_with(|| pattern(model));
                matrix.assemble(room);
                stored = Interruptible { operator: &*room, interrupt };
                &stored
            }
        };
        let jacobi = BlockJacobi(&evaluation.inverse);
        let two_level;
        let preconditioner: &dyn Preconditioner<R> = match solver.preconditioner {
            PreconditionerKind::Identity => &Identity,
            PreconditionerKind::Diagonal | PreconditionerKind::BlockJacobi | PreconditionerKind::Auto => {
                &jacobi
            }
            PreconditionerKind::TwoLevel => {
                let layout = model.coarse.as_ref().expect("laid out for these settings");
                coarse.fill(layout, &|block, blocks| matrix.project(layout, block, blocks));
                two_level = TwoLevel::new(&evaluation.inverse, layout, coarse);
                &two_level
            }
        };
        let (b, share) = (&evaluation.rows, &model.share);
        let mut report = conjugate_gradient(operator, preconditioner, b, &mut next.dv, solver, share, cg);
        if solver.preconditioner == PreconditionerKind::TwoLevel && is_unfit(report.outcome) {
            begin(&mut next.dv);
            let again = conjugate_gradient(operator, &jacobi, b, &mut next.dv, solver, share, cg);
            let iterations = report.iterations.saturating_add(again.iterations);
            let products = report.products.saturating_add(again.products);
            report = SolveReport { iterations, products, ..again };
        }
        if let Some(common) = &common {
            common.add(model, &mut next.dv);
            cg.lower(common.descent);
        }
        self.work.products += u64::from(report.products);
        self.watch.lap(Stage::Solve);
        SolveReport { preconditioner: Some(solver.preconditioner), ..report }
    }
}

/// Refuses a solve that solved nothing, not even for gravity.
pub(super) fn check(report: &SolveReport) -> Result<(), StepFailure> {
    match report.outcome {
        Outcome::NotFinite { .. }
        | Outcome::Singular { .. }
        | Outcome::IndefinitePreconditioner { iteration: 0 } => {
            Err(StepFailure::Solver { outcome: report.outcome })
        }
        Outcome::Converged
        | Outcome::IterationCap
        | Outcome::NegativeCurvature { .. }
        | Outcome::ZeroCurvature { .. }
        | Outcome::IndefinitePreconditioner { .. } => Ok(()),
    }
}

/// Whether a preconditioner with a coarse space failed: of an indefinite matrix it may be indefinite, where its inverse
/// diagonal blocks are not.
fn is_unfit(outcome: Outcome) -> bool {
    matches!(outcome, Outcome::IndefinitePreconditioner { .. } | Outcome::NotFinite { iteration: 0 })
}

/// An operator whose solve can be given up.
struct Interruptible<'a, R> {
    operator: &'a dyn LinearOperator<R>,
    interrupt: &'a Interrupt,
}

impl<R: Real> LinearOperator<R> for Interruptible<'_, R> {
    fn apply(&self, first_row: usize, p: &[Padded<R>], q: &mut [Sixteen<R>]) -> [f64; 2] {
        self.operator.apply(first_row, p, q)
    }

    fn is_interrupted(&self) -> bool {
        self.interrupt.is_requested()
    }
}
