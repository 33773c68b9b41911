//! Implicit Euler, one Newton step: (M - h df/dv - h² df/dx) dv = h (f + h df/dx v), v' = v + dv,
//! x' = x + h v' (Baraff and Witkin 1998; Zara 2001, eq. 1-3).
//!
//! df/dx is the elastic part alone; compressed springs as the settings' `hessian` says.

use super::stages::{Step, add_scaled};
use crate::{
    cloth::{
        forces::{Transverse, WithTransverse, with_transverse},
        settings::ClothSettings,
        step_operator::{StepOperator, pattern},
    },
    interrupt::Interrupt,
    linalg::{
        BlockJacobi, CgWorkspace, Diagonal, Identity, Inverse3, LinearOperator, OperatorKind, Outcome,
        Preconditioner, PreconditionerKind, SolveReport, SolverSettings, conjugate_gradient,
    },
    math::{Padded, Real, Vec3},
    report::{Stage, StepFailure},
};

pub(super) fn advance<R: Real>(
    step: &mut Step<'_, R>,
    settings: &ClothSettings,
    interrupt: &Interrupt,
) -> Result<SolveReport, StepFailure> {
    step.forces();
    let report = with_transverse(settings.hessian, Solve { step, settings, interrupt });
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

    step.kick_by_dv();
    step.drift(step.dt());
    Ok(report)
}

struct Solve<'s, 'a, R: Real> {
    step: &'s mut Step<'a, R>,
    settings: &'s ClothSettings,
    interrupt: &'s Interrupt,
}

impl<R: Real> WithTransverse for Solve<'_, '_, R> {
    type Output = SolveReport;

    /// Solves for the change of velocity, into the state's `dv`.
    fn run(self, transverse: impl Transverse) -> SolveReport {
        let (Step { model, state, work, watch }, solver) = (self.step, &self.settings.solver);
        let mut dv = std::mem::take(&mut state.dv);
        dv.resize(model.count, Vec3::zeros());

        let [x, v] = &work.padded;
        let operator = StepOperator { model, frozen: &work.frozen, x, transverse };
        operator.right_hand_side(v, &work.f, &mut work.b);

        if solver.preconditioner != PreconditionerKind::Identity {
            operator.invert_diagonal(solver.preconditioner, &mut work.inverse);
        }
        if solver.operator == OperatorKind::Assembled {
            operator.assemble(work.assembled.get_or_insert_with(|| pattern(model)));
        }

        watch.lap(Stage::Matrix);
        let (interrupt, block_size) = (self.interrupt, model.block_size);
        let system = System { b: &work.b, inverse: &work.inverse, solver, block_size, interrupt };
        let report = match (&work.assembled, solver.operator) {
            (Some(matrix), OperatorKind::Assembled) => system.solve(matrix, &mut dv, &mut work.cg),
            _ => system.solve(&operator, &mut dv, &mut work.cg),
        };

        watch.lap(Stage::Solve);
        state.dv = dv;
        report
    }
}

struct System<'a, R: Real> {
    b: &'a [Vec3<R>],
    inverse: &'a [Inverse3<R>],
    solver: &'a SolverSettings,
    block_size: usize,
    interrupt: &'a Interrupt,
}

impl<R: Real> System<'_, R> {
    fn solve(&self, a: &dyn LinearOperator<R>, x: &mut [Vec3<R>], work: &mut CgWorkspace<R>) -> SolveReport {
        let Self { b, inverse, solver, block_size, interrupt } = *self;
        let a = Interruptible { operator: a, interrupt };
        let m: &dyn Preconditioner<R> = match solver.preconditioner {
            PreconditionerKind::Identity => &Identity,
            PreconditionerKind::Diagonal => &Diagonal(inverse),
            PreconditionerKind::BlockJacobi => &BlockJacobi(inverse),
        };
        conjugate_gradient(&a, m, b, x, solver, block_size, work)
    }
}

/// An operator whose solve can be given up.
struct Interruptible<'a, R> {
    operator: &'a dyn LinearOperator<R>,
    interrupt: &'a Interrupt,
}

impl<R: Real> LinearOperator<R> for Interruptible<'_, R> {
    fn apply(&self, first_row: usize, p: &[Padded<R>], out: &mut [Vec3<R>]) {
        self.operator.apply(first_row, p, out);
    }

    fn is_interrupted(&self) -> bool {
        self.interrupt.is_requested()
    }
}

impl<R: Real> Step<'_, R> {
    fn has_finite_forces(&self) -> bool {
        self.work.b.iter().flatten().all(|c| c.to_f64().is_finite())
    }

    /// dv = b for free particles: a force that is not finite reaches the velocity of its particle.
    fn show_forces(&mut self) {
        let free = self.model.inv_m.iter().map(|inv_m| *inv_m > R::zero());
        for ((dv, b), free) in self.state.dv.iter_mut().zip(&self.work.b).zip(free) {
            *dv = if free { *b } else { Vec3::zeros() };
        }
    }

    /// v += dv.
    fn kick_by_dv(&mut self) {
        add_scaled(&mut self.state.v, &self.state.dv, R::one(), self.model.block_size);
        self.watch.lap(Stage::Velocity);
    }
}
