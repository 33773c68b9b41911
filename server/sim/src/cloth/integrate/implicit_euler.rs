//! Implicit Euler, one Newton step: (M - h df/dv - h² df/dx) dv = h (f + h df/dx v), v' = v + dv,
//! x' = x + h v' (Baraff and Witkin 1998; Zara 2001, eq. 1-3).
//!
//! df/dx is the elastic part alone; compressed springs as the settings' `hessian` says.

use super::update::{Change, MovedBy, Step, write_next};
use crate::{
    cloth::{
        settings::ClothSettings,
        step_matrix::{StepMatrix, pattern},
        workspace::Workspace,
    },
    interrupt::Interrupt,
    linalg::{
        BlockJacobi, Identity, LinearOperator, OperatorKind, Outcome, Preconditioner, PreconditionerKind,
        SolveReport, TwoLevel, conjugate_gradient,
    },
    math::{LANES, Padded, Real, Sixteen, Vec3, array3},
    report::{Stage, StepFailure},
};

pub(super) fn advance<R: Real>(
    step: &mut Step<'_, R>,
    settings: &ClothSettings,
    interrupt: &Interrupt,
) -> Result<SolveReport, StepFailure> {
    let report = step.solve(settings, interrupt);
    if interrupt.is_requested() {
        return Err(StepFailure::Interrupted);
    }

    match report.outcome {
        // Forces left the range of the precision: the velocities that they make show where.
        Outcome::NotFinite { iteration: 0 } if !step.has_finite_forces() => step.show_forces(),
        // Nothing is solved, not even gravity.
        Outcome::NotFinite { .. }
        | Outcome::Singular { .. }
        | Outcome::IndefinitePreconditioner { iteration: 0 } => {
            return Err(StepFailure::Solver { outcome: report.outcome });
        }
        Outcome::Converged
        | Outcome::IterationCap
        | Outcome::NegativeCurvature { .. }
        | Outcome::ZeroCurvature { .. }
        | Outcome::IndefinitePreconditioner { .. } => {}
    }

    step.kick_by_dv_and_drift();
    Ok(report)
}

impl<R: Real> Step<'_, R> {
    /// Solves for the change of velocity, into the `dv` of the next state.
    fn solve(&mut self, settings: &ClothSettings, interrupt: &Interrupt) -> SolveReport {
        let (model, state, solver) = (self.model, self.state, &settings.solver);
        let Workspace { evaluation, numbers, next, assembled, coarse, cg, scratches, .. } = &mut *self.work;
        let groups = evaluation.rows.len();
        next.dv.resize(groups, Sixteen::default());
        let begin = |dv: &mut [Sixteen<R>]| {
            if solver.warm_start && state.dv.len() == groups {
                dv.copy_from_slice(&state.dv);
            } else {
                dv.fill(Sixteen::default());
            }
        };
        begin(&mut next.dv);

        let numbers = &*numbers;
        let matrix = StepMatrix::new((model, numbers), &state.x, evaluation, scratches, interrupt);
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
            PreconditionerKind::Diagonal | PreconditionerKind::BlockJacobi => &jacobi,
            PreconditionerKind::TwoLevel => {
                let layout = model.coarse.as_ref().expect("laid out for these settings");
                coarse.fill(layout, &|block, blocks| matrix.project(layout, block, blocks));
                two_level = TwoLevel::new(&evaluation.inverse, layout, coarse);
                &two_level
            }
        };
        let (b, size) = (&evaluation.rows, model.block_size);
        let mut report = conjugate_gradient(operator, preconditioner, b, &mut next.dv, solver, size, cg);
        if solver.preconditioner == PreconditionerKind::TwoLevel && is_unfit(report.outcome) {
            begin(&mut next.dv);
            let again = conjugate_gradient(operator, &jacobi, b, &mut next.dv, solver, size, cg);
            let iterations = report.iterations.saturating_add(again.iterations);
            let products = report.products.saturating_add(again.products);
            report = SolveReport { iterations, products, ..again };
        }
        self.watch.lap(Stage::Solve);
        report
    }

    fn has_finite_forces(&self) -> bool {
        self.work.evaluation.rows.iter().all(|row| row.0.iter().flatten().all(|c| c.to_f64().is_finite()))
    }

    /// dv = b for free particles: a force that is not finite reaches the velocity of its particle.
    fn show_forces(&mut self) {
        let Workspace { evaluation, next, .. } = &mut *self.work;
        let places = self.model.inv_m.iter().enumerate();
        for (i, inv_m) in places {
            let (group, lane) = (i / LANES, i % LANES);
            let is_free = *inv_m > R::zero();
            let dv = if is_free { evaluation.rows[group].get(lane) } else { Vec3::zeros() };
            next.dv[group].set(lane, dv);
        }
    }

    /// v' = v + dv, x' = x + h v'.
    fn kick_by_dv_and_drift(&mut self) {
        let dt = self.dt();
        let Workspace { next, moved, numbers, .. } = &mut *self.work;
        let dv = std::mem::take(&mut next.dv);
        let wind = Some(array3(&numbers.wind));
        let change = Change { a: &dv, h: R::one(), dt, by: MovedBy::New, wind };
        write_next(self.model, self.state, next, &change, moved);
        next.dv = dv;
        self.watch.lap(Stage::Position);
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
