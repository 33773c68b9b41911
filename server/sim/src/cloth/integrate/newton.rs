//! Newton's method for the minimisation of an implicit step: linear solves from iterate to iterate, each with a line
//! search on what is minimised, until forces and inertia are in balance.
//!
//! Solves are made with the exact tangent, as far as it is positive definite: the absolute one, which a single solve per step
//! needs, leads to the minimum in small steps where springs are compressed. It preconditions, and as much of it is added to
//! the exact one as a solve asks for.
//!
//! A balance may be a saddle: a flat sheet under compression is one. So the exact tangent is searched for a direction of
//! negative curvature at the end, and followed where there is one (Nocedal and Wright, Numerical Optimization, ch. 3.4).

use super::{at::At, iterate::Start, mix::Mix, solve::check, update::Step, vectors::Vectors};
use crate::{
    cloth::{
        evaluate::{Evaluated, Leftover, Total},
        judge::{Found, risen_most, rounding},
        settings::{ClothSettings, Minimizer, NewtonSettings, Purpose},
        state::State,
    },
    interrupt::Interrupt,
    linalg::{Outcome, SolveReport},
    math::Real,
    report::{Stage, StepFailure},
};

/// Least share of the predicted fall that a fall must be (Armijo's rule).
const SHARE: f64 = 1e-4;
/// How much of the residual along a change may point back after it, of damped cloth.
const BACK: f64 = 0.5;
/// Where rounding hides whether G falls, what the square of the residual must shrink to.
const HIDDEN: f64 = 0.98;
/// How often a change is halved, at most.
const HALVINGS: u32 = 20;

/// Solves of a step by one of which a change has to be taken whole: half of a change is half of a momentum.
const WHOLE_WITHIN: u32 = 8;

/// Share of the kinetic energy that forces from outside give a part as a whole, by which a number of sweeps may miss the minimum.
const SWEEPS: f64 = 0.1;

/// How often a step may leave a saddle.
const SADDLES: u32 = 4;

/// An iterate that was evaluated.
#[derive(Clone, Copy)]
pub(super) struct Iterate {
    pub(super) total: Total,
    leftover: Leftover,
    /// Potential of damping and medium (J), for directions of springs as they were at the iterate before.
    lagged: f64,
}

impl Iterate {
    /// What is minimised (J), for directions of springs as they are.
    pub(super) fn value(&self) -> f64 {
        self.leftover.inertia + self.total.potential() + self.total.dissipation()
    }

    /// What is minimised (J), for directions of springs as they were at the iterate before. Damping has no potential where
    /// directions change; with these it has one, whose slope there is its force.
    pub(super) fn value_on_the_way(&self) -> f64 {
        self.leftover.inertia + self.total.potential() + self.lagged
    }
}

/// Writes where the step leads; returns its solves as one, what they found, and what the error of a particle is of the
/// vector that its block added up.
pub(super) fn advance<R: Real>(
    step: &mut Step<'_, R>,
    settings: &ClothSettings,
    interrupt: &Interrupt,
) -> Result<(SolveReport, Found, f64), StepFailure> {
    let newton = match settings.minimizer {
        Minimizer::Newton(newton) => newton,
        _ => NewtonSettings { tolerance: 0.0, max_iterations: WHOLE_WITHIN },
    };
    let inertia = step.predict();
    let mut search = Search { step, settings, interrupt, report: None, mix: Mix::EXACT, taken: 0.0 };
    let first = search.evaluate(Tried::Next);
    if let Some(accuracy) = settings.accuracy() {
        let last = search.go_on(first, accuracy)?;
        return Ok(search.end(inertia, [first, last], Outcome::Converged));
    }
    let (mut last, mut is_done) = search.run(first, &newton)?;
    if let Minimizer::Newton(_) = settings.minimizer {
        for _ in 0..SADDLES {
            if !is_done || !last.value().is_finite() {
                break;
            }
            let Some(lower) = search.leave_saddle(&last)? else { break };
            (last, is_done) = search.run(lower, &newton)?;
        }
    }
    let outcome = if is_done { Outcome::Converged } else { Outcome::IterationCap };
    Ok(search.end(inertia, [first, last], outcome))
}

impl<R: Real> Step<'_, R> {
    /// Writes the iterate at which velocities do not change into `next`; returns the inertia of the start of the step, in the sense of
    /// [`Leftover`].
    pub(super) fn predict(&mut self) -> f64 {
        let State { x, v, .. } = &mut *self.next;
        let start = Start::new(self.model, self.state, &self.evaluated.numbers);
        let inertia = start.predict([x, v], &mut self.vectors.inertias);
        self.watch.lap(Stage::Position);
        inertia
    }

    /// Ends the step that the iterate in `next` is the solution of.
    fn finish_iterate(&mut self, settings: &ClothSettings) -> f64 {
        let Vectors { moved, trial: [x, v], .. } = &mut *self.vectors;
        let (next, numbers) = (&mut *self.next, &self.evaluated.numbers);
        std::mem::swap(&mut next.x, x);
        std::mem::swap(&mut next.v, v);
        let scale =
            Start::new(self.model, self.state, numbers).finish(settings.integrator, [x, v], next, moved);
        // Of a step from the state more is evaluated.
        if numbers.scheme.beyond == 1.0 && !settings.solves_from_state() {
            self.evaluated.know(Purpose::of(settings));
        }
        self.watch.lap(Stage::Position);
        scale
    }
}

/// Where what is evaluated stands.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Tried {
    /// In `next`: the iterate.
    Next,
    /// In `trial`: what the line search tries.
    Trial,
}

/// A minimisation on its way.
pub(super) struct Search<'s, 'a, R: Real> {
    pub(super) step: &'s mut Step<'a, R>,
    pub(super) settings: &'s ClothSettings,
    pub(super) interrupt: &'s Interrupt,
    /// The linear solves so far.
    pub(super) report: Option<SolveReport>,
    /// The tangent of the last one, where tangents are mixed.
    pub(super) mix: Mix,
    /// The share of the last change that was taken.
    pub(super) taken: f64,
}

impl<R: Real> Search<'_, '_, R> {
    /// Evaluates an iterate; the rows are then its residual.
    pub(super) fn evaluate(&mut self, tried: Tried) -> Iterate {
        let kind = Purpose::Iterate(self.settings.solver.preconditioner);
        let Step { model, state, next, evaluated, vectors, watch, .. } = &mut *self.step;
        let Evaluated { evaluation, numbers, scratches, .. } = &mut **evaluated;
        let State { x: next_x, v: next_v, dv, .. } = &mut **next;
        let Vectors { trial: [trial_x, trial_v], leftovers, .. } = &mut **vectors;
        let is_lagged = tried == Tried::Trial && numbers.has_turning_damping();
        let lagged = is_lagged.then(|| {
            evaluation.run(model, numbers, kind, [&mut *next_x, &mut *trial_v], scratches);
            evaluation.total.dissipation()
        });
        let [x, v] = if tried == Tried::Next { [next_x, next_v] } else { [trial_x, trial_v] };
        evaluation.run(model, numbers, kind, [x, &mut *v], scratches);
        let change = (tried == Tried::Trial).then_some(&**dv);
        let leftover = Start::new(model, state, numbers).leave_over(evaluation, v, change, leftovers);
        watch.lap(Stage::Force);
        let total = evaluation.total;
        Iterate { total, leftover, lagged: lagged.unwrap_or(total.dissipation()) }
    }

    /// Goes on from the iterate in `next`, which was evaluated, to the last one; says whether that is the solution, as
    /// far as the precision goes. At least one solve is made, so that slow motion is not taken for none.
    fn run(&mut self, first: Iterate, newton: &NewtonSettings) -> Result<(Iterate, bool), StepFailure> {
        let is_one = self.settings.starts_with_one_solve();
        let mut now = first;
        for iteration in 0..newton.max_iterations {
            let tolerance = if iteration == 0 { 0.0 } else { newton.tolerance };
            // What is not finite shows in the diagnostics of where the step leads.
            if now.leftover.largest <= tolerance || !now.value().is_finite() {
                return Ok((now, true));
            }
            self.solve_again()?;
            let Some(new) = self.search(&now)? else { return Ok((now, true)) };
            now = new;
            if is_one && self.taken == 1.0 {
                return Ok((now, true));
            }
        }
        if is_one && !self.settings.time_step.is_unchecked() {
            return Err(self.no_descent());
        }
        let is_done = now.leftover.largest <= newton.tolerance;
        Ok((now, is_done))
    }

    /// Makes another of its solves, and adds it to the others.
    pub(super) fn solve_again(&mut self) -> Result<(), StepFailure> {
        let report = self.solve();
        if self.interrupt.is_requested() {
            return Err(StepFailure::Interrupted);
        }
        check(&report)?;
        self.report = Some(self.report.map_or(report, |others| others.and(report)));
        Ok(())
    }

    /// Solves for the change of velocity from the iterate in `next`, which was evaluated.
    pub(super) fn solve(&mut self) -> SolveReport {
        // Where one is enough it has the tangent that one alone needs.
        let is_alone = self.report.is_none() && self.settings.starts_with_one_solve();
        let report = if self.settings.mixes_tangents() && !is_alone {
            let mixes = [self.mix.with_less(), Mix::ABSOLUTE];
            let (report, mix) = self.step.solve_mixed(At::Iterate, mixes, self.settings, self.interrupt);
            self.mix = mix;
            report
        } else {
            self.step.solve(At::Iterate, self.settings, self.interrupt)
        };
        self.step.balance_change_of_iterate();
        report
    }

    /// Takes a share of the change that was solved for, such that what is minimised falls; none where rounding hides
    /// whether it does.
    pub(super) fn search(&mut self, now: &Iterate) -> Result<Option<Iterate>, StepFailure> {
        let predicted = self.step.solver.cg.descent();
        let slack = self.slack(now);
        let mut share = 1.0;
        for _ in 0..HALVINGS {
            self.go(share);
            let new = self.evaluate(Tried::Trial);
            let is_lower = new.value_on_the_way() <= now.value() - 2.0 * SHARE * share * predicted;
            // Directions at the end may differ: the residual there may not point back by much. r.du is twice what the
            // solve predicts.
            let is_damped = self.step.evaluated.numbers.has_turning_damping();
            let is_short = !is_damped || new.leftover.along >= -BACK * 2.0 * predicted;
            let is_hidden = predicted <= slack && new.leftover.square <= HIDDEN * now.leftover.square;
            if is_lower && is_short || is_hidden {
                self.take();
                self.taken = share;
                return Ok(Some(new));
            }
            if predicted <= slack {
                self.evaluate(Tried::Next);
                return Ok(None);
            }
            share *= 0.5;
        }
        Err(self.no_descent())
    }

    /// No change, or none as a whole, lowers what is minimised.
    fn no_descent(&self) -> StepFailure {
        let Step { model, state, next, evaluated, solver, .. } = &*self.step;
        let particle = risen_most(model, &evaluated.numbers, [state, next]);
        let predicted = solver.cg.descent();
        StepFailure::Descent { particle, value: 0.0, predicted, limit: SHARE }
    }

    /// A bound on what rounding does to the difference of two values near this one (J).
    pub(super) fn slack(&self, now: &Iterate) -> f64 {
        let Step { model, evaluated, .. } = &*self.step;
        2.0 * rounding(model, &evaluated.numbers, &now.total, evaluated.evaluation.largest_coordinate)
    }

    /// Writes a share of the change of velocities into `trial`.
    pub(super) fn go(&mut self, share: f64) {
        let Step { model, state, next, evaluated, vectors, watch, .. } = &mut *self.step;
        let [x, v] = &mut vectors.trial;
        Start::new(model, state, &evaluated.numbers).go([&next.x, &next.v], &next.dv, share, [x, v]);
        watch.lap(Stage::Position);
    }

    /// Takes what was tried for the iterate.
    pub(super) fn take(&mut self) {
        let Step { next, vectors, .. } = &mut *self.step;
        let [x, v] = &mut vectors.trial;
        std::mem::swap(&mut next.x, x);
        std::mem::swap(&mut next.v, v);
    }

    /// Ends the step that the last of two iterates is the solution of, from the first one and the inertia of its start: see
    /// [`advance`].
    pub(super) fn end(
        self,
        inertia: f64,
        [first, last]: [Iterate; 2],
        outcome: Outcome,
    ) -> (SolveReport, Found, f64) {
        let report = self.report(&first, &last, outcome);
        let lift = self.step.balance_iterate();
        let pins = |iterate: &Iterate| iterate.total.pin_work_from(self.step.common.pins).max(0.0);
        let pin_work = pins(&first) + pins(&last);
        let left = if self.settings.has_sweeps() { SWEEPS * self.step.common.fallen } else { 0.0 };
        let found = Found::Iterate {
            inertia,
            potential: last.total.potential() + lift.unwrap_or(0.0),
            pin_work,
            left,
        };
        let scale = self.step.finish_iterate(self.settings);
        if lift.is_some() {
            self.step.evaluated.forget();
        }
        (report, found, scale)
    }

    /// All solves as one.
    fn report(&self, first: &Iterate, last: &Iterate, outcome: Outcome) -> SolveReport {
        let none = SolveReport::at_once(Outcome::Converged, 0.0);
        let report = self.report.unwrap_or(none);
        if self.settings.starts_with_one_solve() || first.leftover.square == 0.0 {
            return report;
        }
        let relative_residual = (last.leftover.square / first.leftover.square).sqrt();
        // Where iterates end at their cap, what the last change lowered is about what is left.
        let residual = (2.0 * self.step.solver.cg.descent()).max(0.0).sqrt();
        SolveReport { outcome, relative_residual, residual, ..report }
    }
}
