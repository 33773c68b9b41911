//! One linear solve per step, the first step of Newton's method from the state as it is: (M - h df/dv - h² df/dx) dv =
//! h (f + h df/dx v) (Baraff and Witkin 1998; Zara 2001, eq. 1-3).
//!
//! df/dx is the elastic part alone; compressed springs as the settings' `hessian` says, but on the right-hand side of the
//! implicit midpoint, where it is exact: that is its order.

use super::{
    at::At,
    iterate::Start,
    solve::check,
    update::{Change, MovedBy, Step, Weighed, write_next},
    vectors::Vectors,
};
use crate::{
    cloth::{
        evaluate::Evaluated,
        judge::Found,
        settings::{ClothSettings, Purpose},
        state::State,
    },
    interrupt::Interrupt,
    linalg::{Outcome, SolveReport},
    math::{LANES, Padded, Real, Vec3},
    report::{Stage, StepFailure},
};

/// Writes where the step leads; returns its solve, what it found, and what the error of a particle is of the vector that
/// its block added up.
pub(super) fn advance<R: Real>(
    step: &mut Step<'_, R>,
    settings: &ClothSettings,
    interrupt: &Interrupt,
) -> Result<(SolveReport, Found, f64), StepFailure> {
    let report = step.solve(At::State, settings, interrupt);
    if interrupt.is_requested() {
        return Err(StepFailure::Interrupted);
    }

    // Forces left the range of the precision: the velocities that they make show where.
    if matches!(report.outcome, Outcome::NotFinite { iteration: 0 }) && !step.has_finite_forces() {
        step.show_forces();
    } else {
        check(&report)?;
    }
    step.balance_change();
    if step.evaluated.numbers.scheme.beyond == 1.0 {
        step.kick_by_dv_and_drift();
        return Ok((report, Found::End, step.error_of_change()));
    }
    let (found, scale) = step.go_beyond(settings);
    Ok((report, found, scale))
}

impl<R: Real> Step<'_, R> {
    pub(super) fn has_finite_forces(&self) -> bool {
        let share = &self.model.share;
        let rows = share.own().groups(&self.evaluated.evaluation.rows);
        let is_finite = rows.iter().all(|row| row.0.iter().flatten().all(|c| c.to_f64().is_finite()));
        let mut are_finite = true;
        share.tell([f64::from(u8::from(is_finite))], |[of_rank]| are_finite &= of_rank > 0.0);
        are_finite
    }

    /// Whether positions and velocities at the end are numbers.
    pub(super) fn has_finite_ends(&self) -> bool {
        let is_finite = |row: &Padded<R>| row.vector().iter().all(|c| c.to_f64().is_finite());
        let State { x, v, .. } = &*self.next;
        x.iter().all(is_finite) && v.iter().all(is_finite)
    }

    /// dv = b for free particles: a force that is not finite reaches the velocity of its particle.
    pub(super) fn show_forces(&mut self) {
        let (rows, next) = (&self.evaluated.evaluation.rows, &mut *self.next);
        let places = self.model.inv_m.iter().enumerate();
        for (i, inv_m) in places {
            let (group, lane) = (i / LANES, i % LANES);
            let is_free = *inv_m > R::zero();
            let dv = if is_free { rows[group].get(lane) } else { Vec3::zeros() };
            next.dv[group].set(lane, dv);
        }
    }

    /// v' = v + dv, x' = x + h v'.
    pub(super) fn kick_by_dv_and_drift(&mut self) {
        let dt = self.dt();
        let (next, numbers) = (&mut *self.next, &self.evaluated.numbers);
        let dv = std::mem::take(&mut next.dv);
        let change = Change { a: &dv, h: R::one(), dt, by: MovedBy::New, weighed: Weighed::All, numbers };
        write_next(self.model, self.state, next, &change, &mut self.vectors.moved);
        next.dv = dv;
        self.watch.lap(Stage::Position);
    }

    /// v' = v + 2 dv, x' = x + H (v + dv), by way of the state in the middle, which is what was solved for.
    fn go_beyond(&mut self, settings: &ClothSettings) -> (Found, f64) {
        let Evaluated { evaluation, numbers, scratches, .. } = &mut *self.evaluated;
        let Vectors { moved, inertias, trial: [x, v], .. } = &mut *self.vectors;
        let next = &mut *self.next;
        let start = Start::new(self.model, self.state, numbers);
        start.predict([&mut next.x, &mut next.v], inertias);
        start.go([&next.x, &next.v], &next.dv, 1.0, [x, v]);
        self.watch.lap(Stage::Position);
        evaluation.run(
            self.model,
            numbers,
            Purpose::Iterate(settings.solver.preconditioner),
            [&mut *x, &mut *v],
            scratches,
        );
        self.watch.lap(Stage::Force);

        let (potential, pin_work) =
            (evaluation.total.potential(), evaluation.total.pin_work_from(self.common.pins));
        let scale = start.finish(settings.integrator, [x, v], next, moved);
        self.watch.lap(Stage::Position);
        (Found::Middle { potential, pin_work }, scale)
    }
}
