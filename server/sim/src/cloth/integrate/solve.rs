//! The linear solve of an implicit step, with the matrix and right-hand side that an evaluation made.

use super::update::Step;
use crate::{
    cloth::{
        settings::ClothSettings,
        step_matrix::{StepMatrix, pattern},
        workspace::Workspace,
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

/// What springs add to the matrix over masses from which on `auto` is `two_level`. `block_jacobi` takes some 2.7 times its root
/// iterations to 1e-4, two_level 30 to 70 that cost up to twice as much, and its set-up: on sheets of 20 x 20 to
/// 180 x 180 both take the same time at 350, and from 3 500 on two_level is faster at any size.
const STIFF: f64 = 1000.0;

impl<R: Real> Step<'_, R> {
    /// The preconditioner of a solve, which depends on the model and its numbers alone.
    fn preconditioner(&self, asked: PreconditionerKind) -> PreconditionerKind {
        let Step { model, work, .. } = self;
        match asked {
            PreconditionerKind::Auto if model.coarse.is_some() && work.numbers.contrast(model) > STIFF => {
                PreconditionerKind::TwoLevel
            }
            PreconditionerKind::Auto => PreconditionerKind::BlockJacobi,
            asked => asked,
        }
    }

    /// Solves for the change of velocity, into the `dv` of the next state.
    pub(super) fn solve(&mut self, at: At, settings: &ClothSettings, interrupt: &Interrupt) -> SolveReport {
        let (model, state) = (self.model, self.state);
        let warm_start = at == At::State && settings.solver.warm_start;
        let kind = self.preconditioner(settings.solver.preconditioner);
        let solver = &SolverSettings { warm_start, ..settings.solver };
        let Workspace { evaluation, numbers, next, assembled, coarse, cg, scratches, .. } = &mut *self.work;
        let groups = evaluation.rows.len();
        next.dv.resize(groups, Sixteen::default());
        let begin = |dv: &mut [Sixteen<R>]| {
            if warm_start && state.dv.len() == groups {
                dv.copy_from_slice(&state.dv);
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
        let preconditioner: &dyn Preconditioner<R> = match kind {
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
        let (b, size) = (&evaluation.rows, model.block_size);
        let mut report = conjugate_gradient(operator, preconditioner, b, &mut next.dv, solver, size, cg);
        if kind == PreconditionerKind::TwoLevel && is_unfit(report.outcome) {
            begin(&mut next.dv);
            let again = conjugate_gradient(operator, &jacobi, b, &mut next.dv, solver, size, cg);
            let iterations = report.iterations.saturating_add(again.iterations);
            let products = report.products.saturating_add(again.products);
            report = SolveReport { iterations, products, ..again };
        }
        self.watch.lap(Stage::Solve);
        SolveReport { preconditioner: Some(kind), ..report }
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
