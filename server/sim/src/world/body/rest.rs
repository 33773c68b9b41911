//! How still a cloth of a world lies, looked at after each of its steps; and a cloth that sleeps, which is left out of them.
//!
//! A cloth sleeps as a whole: a body, or all that have a thickness. What sleeps takes long steps, and is woken in the step in which
//! something disturbs it.

use super::cloth::Cloth;
use crate::{
    cloth::{self, ClothSettings, Long, RestSettings, Stepping, Watch},
    collide::{Collider, Moved},
    field::Field,
    interrupt::Interrupt,
    linalg::{PreconditionerKind, SolverSettings},
    math::{Padded, Real, Sixteen, array::length, array3},
    report::{Notices, RestReport, StepReport, Stopwatch, Wake, WakeCause, Work},
    sub_step::SubStep,
    surroundings::Surroundings,
    world::setup::report::BodyReport,
};

/// The share of what the rules divide that the solves of a long step may be off.
const SHARE_OF_SOLVE: f64 = 0.02;

impl<R: Real> Cloth<R> {
    /// Whether it is stepped with the others.
    pub(crate) fn is_awake(&self) -> bool {
        self.watch.as_ref().is_none_or(|watch| !watch.is_asleep())
    }

    /// Begins to watch it anew, awake, where it is.
    pub(crate) fn watch_anew(&mut self) {
        if let Some(watch) = &mut self.watch {
            watch.begin(&self.state.x);
        }
        self.resting = None;
    }

    /// Wakes it for a step of the world that begins, before which `step` were taken, where something disturbs it.
    pub(crate) fn stir(&mut self, around: &Surroundings<'_>, step: u64) {
        if self.is_awake() {
            return;
        }
        if let Some(cause) = self.disturbed(around) {
            self.wake(cause, step);
        }
    }

    /// Wakes it, where it sleeps, after so many steps.
    pub(crate) fn wake(&mut self, cause: WakeCause, step: u64) {
        let Self { watch, state, memory, resting, .. } = self;
        let Some(watch) = watch.as_mut().filter(|watch| watch.is_asleep()) else { return };
        watch.wake(&state.x, Wake { step, cause }, 0.0);
        memory.forget();
        *resting = None;
    }

    /// What keeps it awake in a step of the world: what acts on it in another way than in the step before, or leads it.
    fn disturbed(&self, around: &Surroundings<'_>) -> Option<WakeCause> {
        let (watch, rest) = (self.watch.as_ref()?, self.settings.rest?);
        if !self.sent.is_empty() || !self.state.motions.is_empty() {
            return Some(WakeCause::Pin);
        }
        if !self.pulls.is_empty() || self.acting.has_changed(around.time, around.dt) {
            return Some(WakeCause::Force);
        }
        let feels_wind = self.parameters.drag > 0.0 || self.parameters.air.is_some();
        if feels_wind && watch.is_asleep() && watch.wind() != around.wind {
            return Some(WakeCause::Wind);
        }
        let x = &self.state.x[..self.model.count];
        let whole = around.whole();
        let mut moving = around.colliders.iter().filter(|collider| collider.moves(whole.times()));
        moving.any(|collider| comes_near(collider, x, whole, rest.error)).then_some(WakeCause::Collider)
    }

    /// Ends a step of the world, the one with this number, from 1, in which the others were stepped: looks at what is awake, and takes the long
    /// step that is due of what is not. Adds to the report.
    pub(crate) fn end_step(
        &mut self,
        around: &Surroundings<'_>,
        step: u64,
        clock: &mut dyn Stopwatch,
        report: &mut StepReport,
    ) {
        let Some(rest) = self.settings.rest else { return };
        if self.is_awake() {
            self.look(rest, around);
        } else {
            let work = self.sleep_on(rest, around, step, clock);
            // What it was told as last stays, as long as it does not move.
            let diagnostics = self.resting.unwrap_or_else(|| self.diagnose(around));
            self.resting = Some(diagnostics);
            let notices = Notices::default();
            let told = BodyReport {
                diagnostics,
                contact_count: 0,
                solve: None,
                surface: None,
                snow: None,
                notices,
                work,
            };
            told.add_to(report);
        }
        let told = self.watch.as_ref().map(Watch::told);
        report.rest = told.into_iter().chain(report.rest).reduce(RestReport::with);
    }

    /// Takes in a step; falls asleep where all of it is calm, and nothing keeps it awake.
    fn look(&mut self, rest: RestSettings, around: &Surroundings<'_>) {
        let Self { watch, model, state, .. } = self;
        let Some(watch) = watch else { return };
        watch.look(model, rest, &state.x, around.dt);
        let may_sleep = watch.may_sleep(rest) && model.figures.is_empty();
        if !may_sleep || self.disturbed(around).is_some() {
            return;
        }
        self.fall_asleep(rest, around);
    }

    /// Falls asleep after a step.
    fn fall_asleep(&mut self, rest: RestSettings, around: &Surroundings<'_>) {
        let held = self.held(around, Watch::<R>::most_off(rest));
        let Self { watch, model, state, memory, resting, .. } = self;
        let Some(watch) = watch else { return };
        watch.slow(around.dt, (&model.inv_m[..], &mut state.v[..]));
        state.dv.fill(Sixteen::default());
        watch.fall_asleep(around.wind, held);
        memory.forget();
        *resting = None;
    }

    /// The forces (N) with which colliders hold what touches them, or is within `slack` (m), row by row: with all else that acts on it there they
    /// make it move as it was seen to. None of what keeps a thickness, whose solves know colliders.
    fn held(&self, around: &Surroundings<'_>, slack: f64) -> Vec<Padded<R>> {
        let Self { model, parameters, settings, state, acting, watch, .. } = self;
        let Some(watch) = watch else { return Vec::new() };
        if model.thick_surface().is_some() || around.colliders.is_empty() {
            return Vec::new();
        }
        let (given, end) = (acting.now(around.time, around.dt), around.time + around.dt);
        let forces = cloth::evaluated(Field::Forces, model, parameters, settings, around, state, given);
        let accelerations = watch.accelerations(&state.v, [around.dt, self.asked(around)]);
        let of_row = |row: usize| {
            let x = array3(&state.x[row].vector());
            let touches = |collider: &Collider| collider.distance(x, end).0 <= collider.margin + slack;
            if model.inv_m[row] > R::zero() && around.colliders.iter().any(touches) {
                // What slides goes on to gain speed, or to lose it; what is held by friction stands.
                let mass = model.m[row].to_f64();
                let needed = accelerations[row].map(|c| R::of(mass * c));
                Padded::new(&(needed - forces[row / Sixteen::<R>::LANES].get(row % Sixteen::<R>::LANES)))
            } else {
                Padded::default()
            }
        };
        (0..model.count).map(of_row).collect()
    }

    /// Its settings in a long step of `dt` (s). What that may be off is judged when it is taken, and its solves end where positions are known well
    /// enough: r.z is the square of about the velocity that the particle is off which is off most, times the mass of one.
    fn settings_of_long(&self, rest: RestSettings, dt: f64) -> ClothSettings {
        let (solver, model) = (self.settings.solver, &self.model);
        let mass = model.free_mass / model.free_count.max(1) as f64;
        // Without a preconditioner the residual is no energy.
        let is_energy = solver.preconditioner != PreconditionerKind::Identity;
        let floor = if is_energy { SHARE_OF_SOLVE * rest.share() * mass.sqrt() / dt } else { 0.0 };
        ClothSettings { tolerance: None, solver: SolverSettings { floor, ..solver }, ..self.settings }
    }

    /// Counts a step of the world in which it slept, and takes the long step that is due after it, if one is; tells what that cost. Wakes
    /// where the long step did more than it may.
    fn sleep_on(
        &mut self,
        rest: RestSettings,
        around: &Surroundings<'_>,
        step: u64,
        clock: &mut dyn Stopwatch,
    ) -> Work {
        let Some(steps) = self.watch.as_mut().and_then(|watch| watch.pass(step)) else {
            return Work::default();
        };
        let dt = f64::from(steps) * around.dt;
        let sub_step = SubStep { dt, end: around.time + around.dt };
        // Colliders go straight within a step: of what went round the cloth since the last one, only its way in this step of the world counts.
        let mut moved = Moved::of(around.colliders);
        let colliders = moved.over(around.colliders, around.whole());
        // Who gives a step up would have to undo what others took.
        let interrupt = &Interrupt::default();
        let (time, steps) = (sub_step.start(), dt / self.asked(around));
        let long = Surroundings { colliders, time, dt, steps, interrupt, ..*around };
        let settings = self.settings_of_long(rest, dt);

        let Self { model, parameters, state, memory, watch, resting, acting, .. } = self;
        *resting = None;
        let Some(watch) = watch else { return Work::default() };
        let usual = || acting.now(around.time, around.dt);
        memory.set_forces(model, usual().chain(watch.held(&model.user)));
        let found = Stepping {
            model,
            parameters,
            settings: &settings,
            around: &long,
            state: &mut *state,
            memory: &mut *memory,
        }
        .step_long(sub_step, clock);
        let (work, before) = (memory.work(), memory.before());
        let became = if let Ok(told) = found {
            let fields = [[&before.x[..], &before.v[..]], [&state.x[..], &state.v[..]]];
            // A solve that ended at its cap left that much.
            watch.take_long(rest, fields, [dt, told.error.of_solve])
        } else {
            Long::Strays(Watch::<R>::most_off(rest))
        };
        memory.set_forces(model, usual());
        if let Long::Strays(off) = became {
            memory.undo(state);
            watch.wake(&state.x, Wake { step, cause: WakeCause::Motion }, off);
            return work;
        }
        // The next one does not begin where this one led.
        state.dv.fill(Sixteen::default());
        memory.forget();
        if became == Long::Moves {
            watch.wake(&state.x, Wake { step, cause: WakeCause::Motion }, 0.0);
        } else if watch.told().told > rest.error {
            watch.wake(&state.x, Wake { step, cause: WakeCause::Error }, 0.0);
        }
        work
    }
}

/// Whether a collider may come within its margin of a particle in a step, or within `slack` (m) beside.
fn comes_near<R: Real>(collider: &Collider, x: &[Padded<R>], whole: SubStep, slack: f64) -> bool {
    // Distances are exact: they change by no more than the way.
    let is_near = |point: [f64; 3], radius: f64| {
        let [start, end] = whole.times().map(|time| collider.distance(point, time).0);
        let way = length(collider.way_of([point; 2], whole));
        let is_far = start.min(end) - way > radius + collider.margin + slack;
        !is_far
    };
    let wide = |x: &Padded<R>| array3(&x.vector());
    let (center, radius) = ball(x);
    is_near(center, radius) && x.iter().any(|x| is_near(wide(x), 0.0))
}

/// A ball around particles: its center and its radius (m).
fn ball<R: Real>(x: &[Padded<R>]) -> ([f64; 3], f64) {
    let wide = |x: &Padded<R>| array3(&x.vector());
    let [mut low, mut high] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for x in x.iter().map(wide) {
        for c in 0..3 {
            (low[c], high[c]) = (low[c].min(x[c]), high[c].max(x[c]));
        }
    }
    let center = [0, 1, 2].map(|c| 0.5 * (low[c] + high[c]));
    let radius = length([0, 1, 2].map(|c| 0.5 * (high[c] - low[c])));
    (center, radius)
}
