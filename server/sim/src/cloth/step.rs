//! A sub-step of one cloth, in three acts: how long it may be, a try that leaves the state as it is, and its acceptance.
//! All cloths of a world take their sub-steps together: the world calls these for each.

use super::{
    contact::PairEnergy,
    evaluate::{Allowance, Workspace},
    integrate::{self, Advanced},
    judge::{
        After, Before, Found, accept, cause, falls_short, fastest, gain_limit, gained, judge, owed,
        risen_most, rounding, start_of,
    },
    layout::{Model, Parameters},
    settings::{ClothSettings, Integrator, Purpose, Scheme, SurfaceCheck},
    state::{ClothReport, State},
};
use crate::{
    interrupt::Interrupted,
    linalg::{Outcome, PreconditionerKind, SolveReport, Stop},
    math::Real,
    report::{
        BoundKind, Diagnostics, ErrorEstimate, Load, Stage, StepFailure, Stopwatch, SurfaceReport, TimeBound,
        Work,
    },
    surroundings::Surroundings,
    time_step::TimeStep,
};

/// A cloth in the middle of a step of the world.
pub(crate) struct Stepping<'a, R: Real> {
    pub(crate) model: &'a Model<R>,
    pub(crate) parameters: &'a Parameters,
    pub(crate) settings: &'a ClothSettings,
    pub(crate) around: &'a Surroundings<'a>,
    pub(crate) state: &'a mut State<R>,
    pub(crate) work: &'a mut Workspace<R>,
}

impl<R: Real> Stepping<'_, R> {
    /// Begins a step of the world.
    ///
    /// # Panics
    /// If the settings ask for a preconditioner with a coarse space and those that the model was made for do not.
    pub(crate) fn begin(&mut self) {
        self.work.size_for(self.model, self.settings, Purpose::of(self.settings));
        self.work.begin(self.state);
    }

    /// Aims pins for the sub-step that begins: what bounds it is how they move in it.
    pub(crate) fn aim(&mut self) {
        let asked = self.settings.time_step.asked(self.around.dt);
        if self.state.look_ahead(&self.model.share, asked) {
            self.work.forget();
        }
    }

    /// The bound on the next sub-step, with the share that the settings take of it; refuses a fixed length above it.
    pub(crate) fn bound(&mut self, watch: &mut dyn Stopwatch) -> Result<TimeBound, StepFailure> {
        let Self { model, settings, around, .. } = *self;
        let none = TimeBound { kind: BoundKind::Frame, dt: f64::INFINITY, particle: None };
        let fixed = |dt| TimeBound { kind: BoundKind::Fixed, dt, particle: None };
        let purpose = Purpose::of(settings);
        if !matches!(purpose, Purpose::Bounded(_)) {
            return Ok(match settings.time_step {
                TimeStep::Certified { .. } => none,
                TimeStep::Fixed(dt) | TimeStep::Unchecked(dt) => fixed(dt),
            });
        }

        let dt = if self.work.numbers.dt > 0.0 { self.work.numbers.dt } else { around.dt };
        self.refresh(dt);
        self.evaluate(watch);
        let bound = self.work.evaluation.bound;
        let particle = u64::from(model.user[bound.particle as usize]);
        // What is beyond any time is no time.
        if bound.rate > 1e100 {
            return Err(StepFailure::NeverStable { particle });
        }
        let speed = self.work.evaluation.speed;
        let of_speed = u64::from(model.user[speed.particle as usize]);
        let kind = if bound.by_air { BoundKind::Medium } else { settings.integrator.bound() };
        match settings.time_step {
            TimeStep::Certified { safety } => Ok(if speed.rate > bound.rate / safety {
                TimeBound { kind: BoundKind::SpringSpeed, dt: 1.0 / speed.rate, particle: Some(of_speed) }
            } else if bound.rate > 0.0 {
                TimeBound { kind, dt: safety * (1.0 / bound.rate), particle: Some(particle) }
            } else {
                none
            }),
            TimeStep::Fixed(length) => {
                let dt = length.min(around.dt);
                let bounds = [(bound.rate, particle, kind), (speed.rate, of_speed, BoundKind::SpringSpeed)];
                match bounds.into_iter().find(|(rate, ..)| dt > 1.0 / rate) {
                    Some((rate, particle, bound)) => {
                        Err(StepFailure::TimeStep { particle, dt, limit: 1.0 / rate, bound })
                    }
                    None => Ok(fixed(length)),
                }
            }
            TimeStep::Unchecked(dt) => Ok(fixed(dt)),
        }
    }

    /// Takes over parameters and surroundings for a sub-step of `dt` (s).
    fn refresh(&mut self, dt: f64) {
        let lengths = [dt, self.state.past.dt];
        if self.work.numbers.refresh(self.model, self.parameters, self.settings, self.around, lengths) {
            self.work.forget();
        }
    }

    /// Evaluates the state, where that was not done.
    fn evaluate(&mut self, watch: &mut dyn Stopwatch) {
        let purpose = Purpose::of(self.settings);
        if !self.work.is_current(purpose) {
            self.work.evaluate(self.model, purpose, self.state);
            watch.lap(Stage::Force);
        }
    }

    /// Begins a sub-step that is tried, to which [`Self::abandon`] returns.
    pub(crate) fn begin_substep(&mut self) {
        self.work.begin_substep(self.state);
    }

    /// Computes where a sub-step of `dt` (s), which ends at `time` (s), leads, judges it, and lets it meet colliders. Pins are
    /// aimed; no other particle has moved.
    pub(crate) fn attempt(
        &mut self,
        [dt, time]: [f64; 2],
        watch: &mut dyn Stopwatch,
    ) -> Result<(), StepFailure> {
        self.work.allowed = match self.go([dt, time], watch) {
            Ok(allowed) => allowed,
            Err(failure) => return Err(cause(self.model, self.state, failure)),
        };
        self.meet(time, watch)
    }

    /// Computes where a sub-step of `dt` (s), which ends at `time` (s), leads, and judges it; what energy it may have, where that is judged.
    fn go(
        &mut self,
        [dt, time]: [f64; 2],
        watch: &mut dyn Stopwatch,
    ) -> Result<Option<Allowance>, StepFailure> {
        self.refresh(dt);
        let asked = self.settings.time_step.asked(self.around.dt);
        if self.state.aim_pins(&self.model.share, asked, dt / asked) {
            self.work.forget();
        }
        self.evaluate(watch);
        if self.settings.integrator.is_implicit() && !self.settings.solves_from_state() {
            self.work.freeze_air(self.model, self.state);
        }

        let before = Before::of(&self.work.evaluation);
        let (integrator, dt) = (self.settings.integrator, self.work.numbers.dt);
        self.work.start = start_of(self.model, &self.work.evaluation, integrator, dt);
        self.work.make_room(self.state);
        let advanced = self.advance(time, &before, watch)?;
        let Self { model, settings, .. } = *self;
        let work = &mut *self.work;
        // Of an explicit step the evaluation is that of its last kick.
        work.start.last_kick = work.evaluation.total;
        if settings.integrator == Integrator::ExplicitEuler {
            work.start.own = work.numbers.dt * work.numbers.dt * advanced.motion.change;
        }
        let external_work = work.numbers.dt * advanced.motion.external;
        work.start.own += work.numbers.dt * advanced.motion.medium;
        let solve = advanced.solve.map(|(solve, _)| solve);
        let starts_anew = settings.integrator.has_past() && self.state.past.dt == 0.0;
        work.tried = ClothReport {
            solve,
            solves: work.solves,
            error: advanced.motion.error,
            external_work,
            without_history: u32::from(starts_anew),
            surface: model.thick_surface().map(|_| work.contact.report),
            ..ClothReport::default()
        };
        let ClothReport { error, notices, .. } = &mut work.tried;
        if let Some(solve) = &solve {
            notices.count(solve.outcome, settings.stop());
            let is_capped =
                matches!((solve.outcome, settings.stop()), (Outcome::IterationCap, Stop::Residual { .. }));
            // Without a preconditioner the residual is no energy.
            if is_capped && settings.solver.preconditioner != PreconditionerKind::Identity {
                *error = with_solve(*error, model, &work.numbers.scheme, solve.residual);
            }
        }
        if let Some(limit) = settings.tolerance.filter(|limit| error.largest > *limit) {
            let (value, particle) = (error.largest, fastest(model, &work.next));
            return Err(StepFailure::Inaccurate { particle, value, limit });
        }
        let Some((_, found)) = advanced.solve.filter(|_| !settings.time_step.is_unchecked()) else {
            return Ok(None);
        };

        if !work.is_current(Purpose::of(settings)) {
            work.evaluate_next(model, Purpose::of(settings));
            watch.lap(Stage::Force);
        }
        let Workspace { evaluation, next, numbers, .. } = &*self.work;
        if let Some(failure) = judge(model, [&*self.state, next], &evaluation.diagnostics(), settings) {
            return Err(failure);
        }
        accept(model, numbers, &before, &self.after(&advanced, found)).map(Some)
    }

    /// Computes where a sub-step that ends at `time` (s) leads. Goes on from there where one linear solve was made, and is to be followed by
    /// others if that is not enough: where it is, what it led to is evaluated then.
    fn advance(
        &mut self,
        time: f64,
        before: &Before,
        watch: &mut dyn Stopwatch,
    ) -> Result<Advanced, StepFailure> {
        let Self { model, settings, around, .. } = *self;
        let work = &mut *self.work;
        let first = integrate::advance(model, settings, (around, time), self.state, work, watch)?;
        let may_go_on = settings.solves_from_state() && model.thick_surface().is_none();
        let accuracy = settings.accuracy().filter(|_| may_go_on);
        let (Some(accuracy), Some(solved)) = (accuracy, first.solve) else { return Ok(first) };

        // The middle of a step is evaluated already.
        if solved.1 == Found::End {
            work.evaluate_next(model, Purpose::of(settings));
            watch.lap(Stage::Force);
        }
        if !falls_short(model, &self.work.numbers, before, &self.after(&first, solved.1), accuracy) {
            return Ok(first);
        }
        let (interrupt, of_method) = (around.interrupt, (model, settings));
        integrate::go_on(of_method, interrupt, self.state, self.work, watch, solved, accuracy)
    }

    /// What the sub-step that is tried found, to judge it by.
    fn after<'b>(&'b self, advanced: &'b Advanced, found: Found) -> After<'b, R> {
        let Workspace { evaluation, next, cg, contact, common, .. } = &*self.work;
        let is_thick = self.model.thick_surface().is_some();
        After {
            motion: &advanced.motion,
            descent: cg.descent(),
            found,
            evaluation,
            states: [&*self.state, next],
            owed: self.state.gain.energy,
            pairs: if is_thick { contact.energy } else { PairEnergy::default() },
            common,
        }
    }

    /// Gives up a sub-step that this cloth or another one did not accept.
    pub(crate) fn abandon(&mut self) {
        self.work.abandon(self.state);
    }

    /// Takes what was tried for the state; fails where it is asked to give up.
    pub(crate) fn settle(&mut self, watch: &mut dyn Stopwatch) -> Result<(), StepFailure> {
        let Self { model, settings, around, .. } = *self;
        let is_evaluated = self.work.is_current(Purpose::of(settings));
        self.work.accept(self.state);
        if let Some(surface) = &model.surface
            && settings.contact.surface == SurfaceCheck::Count
        {
            let counted = self.work.crossings.of(surface, &self.state.x, around.interrupt);
            let crossings = Some(counted.map_err(|Interrupted| StepFailure::Interrupted)?);
            let tried = &mut self.work.tried.surface;
            *tried = Some(SurfaceReport { crossings, ..tried.unwrap_or_default() });
        }
        let stands = self.state.rest_pins();
        if !is_evaluated || stands {
            self.work.evaluate(model, Purpose::of(settings), self.state);
            watch.lap(Stage::Force);
        }
        if matches!(Purpose::of(settings), Purpose::Bounded(_)) {
            let pins_and_moved = self.moved();
            let Workspace { start, evaluation, numbers, judged, .. } = &*self.work;
            let of_method = (model, numbers, settings.integrator);
            self.state.gain = gained(self.state.gain, of_method, start, evaluation, pins_and_moved, *judged);
        }
        if let Some(allowed) = self.work.allowed {
            let Workspace { start, evaluation, judged, .. } = &*self.work;
            let rise = evaluation.total.energy() - start.energy;
            self.state.gain.energy = owed(self.state.gain.energy, rise, &allowed, *judged);
        }
        self.work.add_to_report();
        Ok(())
    }

    /// Why the energy that explicit steps gained is more than what their method swings by, if it is.
    fn judge_gain(&self) -> Option<StepFailure> {
        let Self { model, settings, state, .. } = self;
        if !matches!(Purpose::of(settings), Purpose::Bounded(_)) {
            return None;
        }
        let numbers = &self.work.numbers;
        let Workspace { evaluation, .. } = &*self.work;
        let rounding = rounding(model, numbers, &evaluation.total, evaluation.largest_coordinate);
        let (value, limit) = (state.gain.grown(), gain_limit(state.gain, settings.integrator, rounding));
        (value > limit).then(|| {
            let particle = risen_most(model, numbers, [self.work.before(), state]);
            StepFailure::EnergyGain { particle, value, limit }
        })
    }

    /// Ends a step of the world: its report, or why its result leaves what is allowed.
    pub(crate) fn finish(&mut self, watch: &mut dyn Stopwatch) -> Result<ClothReport, StepFailure> {
        let diagnostics = self.work.evaluation.diagnostics();
        let failure = judge(self.model, [self.work.before(), self.state], &diagnostics, self.settings);
        let failure = failure.or_else(|| self.judge_gain());
        watch.lap(Stage::Force);
        let Workspace { evaluation, products, report, .. } = &*self.work;
        let work = Work { force_evaluations: evaluation.runs, matrix_products: *products };
        let diagnostics = Diagnostics { external_work: report.external_work, ..diagnostics };
        failure.map_or(Ok(ClothReport { diagnostics, work, ..*report }), Err)
    }
}

impl<R: Real> Stepping<'_, R> {
    /// Adds what the step gave to colliders to their loads.
    pub(crate) fn add_to(&self, loads: &mut [Load]) {
        let Self { model, around, work, .. } = self;
        if work.report.contact_count > 0 {
            let dt_and_end = [around.dt, around.time + around.dt];
            work.contacts.add_to(&model.share, loads, around.colliders, dt_and_end);
        }
    }
}

impl<R: Real> Workspace<R> {
    /// Adds what an accepted sub-step has to tell.
    fn add_to_report(&mut self) {
        let ClothReport {
            contact_count,
            solve,
            solves,
            error,
            without_history,
            notices,
            external_work,
            surface,
            ..
        } = self.tried;
        let report = &mut self.report;
        report.contact_count += contact_count;
        if contact_count > 0 {
            self.contacts.accept();
        }
        report.solves += solves;
        report.without_history += without_history;
        report.external_work += external_work;
        let with = |surface: SurfaceReport| report.surface.map_or(surface, |before| before.and(surface));
        report.surface = surface.map(with).or(report.surface);
        report.notices = report.notices.and(notices);
        report.error = report.error.max(error);
        let with = |solve: SolveReport| report.solve.map_or(solve, |others| others.and(solve));
        report.solve = solve.map(with);
    }
}

/// An estimate that counts what is left over of a solve that ended at its cap: the square of the residual in the norm of the
/// preconditioner is an energy (J), and that of all particles is about what the one has that is furthest off.
fn with_solve<R: Real>(
    error: ErrorEstimate,
    model: &Model<R>,
    scheme: &Scheme,
    residual: f64,
) -> ErrorEstimate {
    let rms = scheme.h * scheme.beyond * residual / model.free_mass.sqrt();
    let of_solve = rms * (model.free_count as f64).sqrt();
    ErrorEstimate { rms: error.rms + rms, largest: error.largest + of_solve, of_solve }
}
