//! The linear solve of an implicit step, with the matrix and right-hand side that an evaluation made.

use super::update::Step;
use crate::{
    cloth::{
        evaluate::{StepMatrix, Workspace, pattern},
        settings::ClothSettings,
    },
    interrupt::Interrupt,
    linalg::{
        LinearOperator, OperatorKind, Outcome, PreconditionerKind, SolveReport, SolverSettings, System, solve,
    },
    math::{Padded, Real, Sixteen},
    parallel::{per_sixteen, per_sixteen_mut, size},
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
        let Workspace { evaluation, numbers, next, assembled, coarse: coarse_matrix, cg, scratches, .. } =
            &mut *self.work;
        let groups = evaluation.rows.len();
        size(&mut next.dv, groups);
        let own = model.share.own();
        let begin = |dv: &mut [Sixteen<R>]| {
            if warm_start && state.dv.len() == groups {
                let fields = (per_sixteen_mut(dv), per_sixteen(&state.dv));
                own.each(fields, |_, (dv, before)| dv.copy_from_slice(before));
                if let Some(common) = &common {
                    common.take_off(model, dv);
                }
            } else if warm_start {
                own.each(per_sixteen_mut(dv), |_, dv| dv.fill(Sixteen::default()));
            }
        };

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
        let coarse = model.coarse.as_ref().filter(|_| solver.preconditioner == PreconditionerKind::TwoLevel);
        let coarse = coarse.map(|layout| {
            coarse_matrix.fill(layout, &|block, blocks| matrix.project(layout, block, blocks));
            (layout, &*coarse_matrix)
        });
        let system = System { operator, b: &evaluation.rows, inverse: &evaluation.inverse, coarse };
        let report = solve(&system, &mut next.dv, &begin, solver, &model.share, cg);
        if let Some(common) = &common {
            common.add(model, &mut next.dv);
            cg.lower(common.descent);
        }
        self.work.products += u64::from(report.products);
        self.watch.lap(Stage::Solve);
        report
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
