//! A sub-step of one cloth, in three acts: how long it may be, a try that leaves the state as it is, and its acceptance.
//! All cloths of a world take their sub-steps together: the world calls these for each.

use super::{attempt::Attempt, memory::StepMemory};
use crate::{
    cloth::{
        contact::PairEnergy,
        evaluate::{Allowance, Evaluated},
        integrate::{self, Advanced, Step},
        judge::{
            After, Before, Found, accept, cause, falls_short, fastest, gain_limit, gained, judge, owed,
            risen_most, rounding, start_of,
        },
        layout::{Model, Parameters, Yield},
        settings::{ClothSettings, Integrator, Purpose, Scheme, SurfaceCheck},
        state::{ClothReport, State},
    },
    interrupt::Interrupted,
    linalg::{Outcome, PreconditionerKind, Stop},
    math::Real,
    report::{
        BoundKind, Diagnostics, ErrorEstimate, Load, Stage, StepFailure, Stopwatch, SurfaceReport, TimeBound,
    },
    sub_step::SubStep,
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
    pub(crate) memory: &'a mut StepMemory<R>,
}

impl<R: Real> Stepping<'_, R> {
    /// Begins a step of the world.
    ///
    /// # Panics
    /// If the settings ask for a preconditioner with a coarse space and those that the model was made for do not.
    pub(crate) fn begin(&mut self) {
        self.memory.size_for(self.model, self.settings);
        self.memory.begin(self.model, self.state);
    }

    /// Aims pins for the sub-step that begins: what bounds it is how they move in it.
    pub(crate) fn aim(&mut self) {
        let asked = self.settings.time_step.asked(self.around.dt);
        if self.state.look_ahead(&self.model.share, asked) {
            self.memory.forget();
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

        // A bound does not depend on how long the sub-step is: numbers of the last one serve.
        let last = self.memory.evaluated.numbers.sub_step;
        self.refresh(if last.dt > 0.0 { last } else { around.whole() });
        self.evaluate(watch);
        let bound = self.memory.evaluated.evaluation.bound;
        let particle = u64::from(model.user[bound.particle as usize]);
        // What is beyond any time is no time.
        if bound.rate > 1e100 {
            return Err(StepFailure::NeverStable { particle });
        }
        let speed = self.memory.evaluated.evaluation.speed;
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

    /// Takes over parameters and surroundings for a sub-step.
    pub(super) fn refresh(&mut self, sub_step: SubStep) {
        let lengths = (sub_step, self.state.past.dt);
        let numbers = &mut self.memory.evaluated.numbers;
        if numbers.refresh(self.model, self.parameters, self.settings, self.around, lengths) {
            self.memory.forget();
        }
    }

    /// Evaluates the state, where that was not done.
    fn evaluate(&mut self, watch: &mut dyn Stopwatch) {
        let (purpose, evaluated) = (Purpose::of(self.settings), &mut self.memory.evaluated);
        if !evaluated.is_current(purpose) {
            evaluated.evaluate(self.model, purpose, self.state);
            watch.lap(Stage::Force);
        }
    }

    /// Begins a sub-step that is tried, to which [`Self::abandon`] returns.
    pub(crate) fn begin_substep(&mut self) {
        self.memory.begin_substep(self.model, self.state);
    }

    /// Computes where a sub-step leads, judges it, and lets it meet colliders. Pins are aimed; no other particle has moved.
    pub(crate) fn attempt(
        &mut self,
        sub_step: SubStep,
        watch: &mut dyn Stopwatch,
    ) -> Result<(), StepFailure> {
        self.memory.attempt.allowed = match self.go(sub_step, watch) {
            Ok(allowed) => allowed,
            Err(failure) => return Err(cause(self.model, self.state, failure)),
        };
        self.meet(watch)
    }

    /// Gives pins on their way, and corners of figures, the velocity that they have in a sub-step.
    fn lead(&mut self, sub_step: SubStep) {
        let (asked, dt) = (self.settings.time_step.asked(self.around.dt), sub_step.dt);
        if self.state.aim_pins(&self.model.share, asked, dt / asked) {
            self.memory.forget();
        }
        // No spring, no air and no energy knows the velocities of corners: what was evaluated stands.
        let led_for = sub_step.end - self.state.led_since;
        let corners = self.model.figures.iter().flat_map(|figure| figure.at(led_for));
        self.state.lead(corners, dt);
    }

    /// Computes where a sub-step leads, and judges it; what energy it may have, where that is judged.
    fn go(&mut self, sub_step: SubStep, watch: &mut dyn Stopwatch) -> Result<Option<Allowance>, StepFailure> {
        self.refresh(sub_step);
        let dt = sub_step.dt;
        self.lead(sub_step);
        self.evaluate(watch);
        if self.settings.integrator.is_implicit() && !self.settings.solves_from_state() {
            self.memory.evaluated.freeze_air(self.model, self.state);
        }

        let evaluation = &self.memory.evaluated.evaluation;
        let before = Before::of(evaluation);
        self.memory.attempt.start = start_of(self.model, evaluation, self.settings.integrator, dt);
        self.memory.turns.make_room(self.state);
        let advanced = self.advance(&before, watch)?;
        let Self { model, settings, .. } = *self;
        let StepMemory { turns, evaluated, solver, contact, attempt, .. } = &mut *self.memory;
        // Of an explicit step the evaluation is that of its last kick.
        attempt.start.last_kick = evaluated.evaluation.total;
        if settings.integrator == Integrator::ExplicitEuler {
            attempt.start.own = dt * dt * advanced.motion.change;
        }
        let external_work = dt * advanced.motion.external;
        attempt.start.own += dt * advanced.motion.medium;
        let solve = advanced.solve.map(|(solve, _)| solve);
        let starts_anew = settings.integrator.has_past() && self.state.past.dt == 0.0;
        attempt.tried = ClothReport {
            solve,
            solves: solver.solves,
            error: advanced.motion.error,
            external_work,
            without_history: u32::from(starts_anew),
            surface: model.thick_surface().map(|_| contact.report),
            ..ClothReport::default()
        };
        let ClothReport { error, notices, .. } = &mut attempt.tried;
        if let Some(solve) = &solve {
            notices.count(solve.outcome, settings.stop());
            let is_capped =
                matches!((solve.outcome, settings.stop()), (Outcome::IterationCap, Stop::Residual { .. }));
            // Without a preconditioner the residual is no energy.
            if is_capped && settings.solver.preconditioner != PreconditionerKind::Identity {
                *error = with_solve(*error, model, &evaluated.numbers.scheme, solve.residual);
            }
        }
        if let Some(limit) = settings.tolerance.filter(|limit| error.largest > *limit) {
            let (value, particle) = (error.largest, fastest(model, &turns.next));
            return Err(StepFailure::Inaccurate { particle, value, limit });
        }
        let Some((_, found)) = advanced.solve.filter(|_| !settings.time_step.is_unchecked()) else {
            return Ok(None);
        };

        if !evaluated.is_current(Purpose::of(settings)) {
            evaluated.evaluate(model, Purpose::of(settings), &mut turns.next);
            watch.lap(Stage::Force);
        }
        if let Some(failure) =
            judge(model, [&*self.state, &turns.next], &evaluated.evaluation.diagnostics(), settings)
        {
            return Err(failure);
        }
        let numbers = &self.memory.evaluated.numbers;
        accept(model, numbers, &before, &self.after(&advanced, found)).map(Some)
    }

    /// Computes where a sub-step leads. Goes on from there where one linear solve was made, and is to be followed by
    /// others if that is not enough: where it is, what it led to is evaluated then.
    fn advance(&mut self, before: &Before, watch: &mut dyn Stopwatch) -> Result<Advanced, StepFailure> {
        let Self { model, settings, around, .. } = *self;
        let first = integrate::advance(&mut self.step(watch), settings, around)?;
        let may_go_on = settings.solves_from_state() && model.thick_surface().is_none();
        let accuracy = settings.accuracy().filter(|_| may_go_on);
        let (Some(accuracy), Some(solved)) = (accuracy, first.solve) else { return Ok(first) };

        // The middle of a step is evaluated already.
        if solved.1 == Found::End {
            let StepMemory { turns, evaluated, .. } = &mut *self.memory;
            evaluated.evaluate(model, Purpose::of(settings), &mut turns.next);
            watch.lap(Stage::Force);
        }
        let numbers = &self.memory.evaluated.numbers;
        if !falls_short(model, numbers, before, &self.after(&first, solved.1), accuracy) {
            return Ok(first);
        }
        integrate::go_on(&mut self.step(watch), settings, around.interrupt, solved, accuracy)
    }

    /// The sub-step that is tried, for its integrator.
    pub(super) fn step<'b>(&'b mut self, watch: &'b mut dyn Stopwatch) -> Step<'b, R> {
        let (model, state) = (self.model, &*self.state);
        let StepMemory { turns, evaluated, solver, vectors, contact, attempt } = &mut *self.memory;
        let Attempt { start, common, of_parts, contacts, .. } = attempt;
        let (start, next) = (&start.total, &mut turns.next);
        Step {
            model,
            state,
            start,
            next,
            evaluated,
            solver,
            vectors,
            contact,
            contacts,
            common,
            of_parts,
            watch,
        }
    }

    /// What the sub-step that is tried found, to judge it by.
    fn after<'b>(&'b self, advanced: &'b Advanced, found: Found) -> After<'b, R> {
        let StepMemory { turns, evaluated, solver, contact, attempt, .. } = &*self.memory;
        let is_thick = self.model.thick_surface().is_some();
        After {
            motion: &advanced.motion,
            descent: solver.cg.descent(),
            found,
            evaluation: &evaluated.evaluation,
            states: [&*self.state, &turns.next],
            owed: self.state.gain.energy,
            pairs: if is_thick { contact.energy } else { PairEnergy::default() },
            common: &attempt.common,
        }
    }

    /// Gives up a sub-step that this cloth or another one did not accept.
    pub(crate) fn abandon(&mut self) {
        self.memory.abandon(self.state);
    }

    /// Takes what was tried for the state; fails where it is asked to give up.
    pub(crate) fn settle(&mut self, watch: &mut dyn Stopwatch) -> Result<(), StepFailure> {
        let Self { model, settings, around, .. } = *self;
        let StepMemory { turns, evaluated, attempt, .. } = &mut *self.memory;
        turns.accept(self.state);
        if let Some(surface) = &model.surface
            && settings.contact.surface == SurfaceCheck::Count
        {
            let counted = attempt.crossings.of(surface, &self.state.x, around.interrupt);
            let crossings = Some(counted.map_err(|Interrupted| StepFailure::Interrupted)?);
            let tried = &mut attempt.tried.surface;
            *tried = Some(SurfaceReport { crossings, ..tried.unwrap_or_default() });
        }
        if model.has_giving_corners() {
            let led_for = evaluated.numbers.sub_step.end - self.state.led_since;
            attempt.tell(model, &Yield::of(&model.figures, &self.state.x, led_for));
        }
        let stands = self.state.rest_pins();
        if !evaluated.is_current(Purpose::of(settings)) || stands {
            evaluated.evaluate(model, Purpose::of(settings), self.state);
            watch.lap(Stage::Force);
        }
        if matches!(Purpose::of(settings), Purpose::Bounded(_)) {
            let pins_and_moved = self.moved();
            let StepMemory { evaluated: Evaluated { evaluation, numbers, .. }, attempt, .. } = &*self.memory;
            let of_method = (model, numbers, settings.integrator);
            let Attempt { start, judged, .. } = attempt;
            self.state.gain = gained(self.state.gain, of_method, start, evaluation, pins_and_moved, *judged);
        }
        let StepMemory { evaluated, attempt, .. } = &mut *self.memory;
        if let Some(allowed) = attempt.allowed {
            let rise = evaluated.evaluation.total.energy() - attempt.start.energy;
            self.state.gain.energy = owed(self.state.gain.energy, rise, &allowed, attempt.judged);
        }
        attempt.add_to_report();
        Ok(())
    }

    /// Why the energy that explicit steps gained is more than what their method swings by, if it is.
    fn judge_gain(&self) -> Option<StepFailure> {
        let Self { model, settings, state, .. } = self;
        if !matches!(Purpose::of(settings), Purpose::Bounded(_)) {
            return None;
        }
        let Evaluated { evaluation, numbers, .. } = &self.memory.evaluated;
        let rounding = rounding(model, numbers, &evaluation.total, evaluation.largest_coordinate);
        let (value, limit) = (state.gain.grown(), gain_limit(state.gain, settings.integrator, rounding));
        (value > limit).then(|| {
            let particle = risen_most(model, numbers, [self.memory.turns.before(), state]);
            StepFailure::EnergyGain { particle, value, limit }
        })
    }

    /// Ends a step of the world: its report, or why its result leaves what is allowed.
    pub(crate) fn finish(&mut self, watch: &mut dyn Stopwatch) -> Result<ClothReport, StepFailure> {
        let StepMemory { evaluated, turns, .. } = &*self.memory;
        let diagnostics = evaluated.evaluation.diagnostics();
        let failure = judge(self.model, [turns.before(), self.state], &diagnostics, self.settings);
        let failure = failure.or_else(|| self.judge_gain());
        watch.lap(Stage::Force);
        let report = &self.memory.attempt.report;
        let work = self.memory.work();
        let diagnostics = Diagnostics { external_work: report.external_work, ..diagnostics };
        failure.map_or(Ok(ClothReport { diagnostics, work, ..*report }), Err)
    }

    /// Adds what the step gave to colliders to their loads.
    pub(crate) fn add_to(&self, loads: &mut [Load]) {
        let Self { model, around, memory, .. } = self;
        if memory.attempt.report.contact_count > 0 {
            memory.attempt.contacts.add_to(&model.share, loads, around.colliders, around.whole());
        }
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
