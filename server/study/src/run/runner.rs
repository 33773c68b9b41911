//! One setting from the start to the last comparison time: states there, seconds, counts, and how it ended.

use std::time::Instant;

use nappe_sim::{
    field::Field,
    report::{Diagnostics, NoStopwatch, StepError, StepFailure, Work},
    world::Simulation,
};

use super::{
    budget::{Phase, Watched},
    end::{End, Failure},
};
use crate::{
    case::{Case, Times},
    method::{Plan, Stepped},
};

/// What a run gave.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// What is compared of the case at each comparison time that was reached: positions (m), x y z per particle, or the number (m) that
    /// is measured of it.
    pub states: Vec<Vec<f64>>,
    /// Seconds of each interval.
    pub seconds: Vec<f64>,
    /// Seconds of all together, with those of an interval in which it failed.
    pub elapsed: f64,
    /// Simulated time that was reached (s).
    pub time: f64,
    /// The same with the step of the world that failed, if one did.
    pub tried: f64,
    /// Forces and products.
    pub work: Work,
    /// Length of its steps (s), the mean where they vary.
    pub dt: f64,
    /// Total energy at the end less that at the start (J).
    pub energy_drift: f64,
    /// The largest length over rest length of any spring, at the ends of steps of the world.
    pub max_stretch: f64,
    /// By how much positions were said to be off, as cloth slept, at most (m); 0 where none did.
    pub told: f64,
    /// Hash of the state that it came to.
    pub state_hash: u64,
    /// How it ended.
    pub end: End,
}

/// A run on its way, an interval at a time.
pub(crate) struct Runner {
    simulation: Simulation,
    stepped: Stepped,
    /// Steps of the world in an interval.
    steps: u64,
    elapsed: f64,
    work: Work,
    /// Steps that were taken, and tries that were not accepted.
    pub(crate) taken: Taken,
    /// Total energy at the start (J).
    start: f64,
    /// Of the state as it is.
    pub(crate) now: Diagnostics,
    max_stretch: f64,
    /// By how much positions were said to be off, at most (m).
    told: f64,
    phase: Phase,
    _watched: Watched,
}

/// Steps of a run.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Taken {
    /// Steps of the cloths and of the snow.
    pub(crate) substeps: u64,
    /// Those that were not accepted, and taken again shorter.
    pub(crate) rejected: u64,
    /// Linear solves that met a curvature that is not positive.
    pub(crate) indefinite: u64,
}

impl Runner {
    /// Builds a simulation, which is given up at the end of a phase.
    pub(crate) fn start(
        case: &Case,
        stepped: impl Into<Stepped>,
        times: &Times,
        phase: &Phase,
    ) -> Result<Self, Failure> {
        let stepped = stepped.into();
        Self::of_plan(case, stepped, stepped.plan(case, times.interval), phase)
    }

    fn of_plan(case: &Case, stepped: Stepped, plan: Plan, phase: &Phase) -> Result<Self, Failure> {
        let refused = |cause: String| Failure { cause, time: 0.0, particle: None, is_refusal: true };
        let Plan { setup, steps } = plan;
        let (mut simulation, _) =
            Simulation::new(&setup, stepped.precision()).map_err(|error| refused(error.to_string()))?;
        simulation.apply(&case.changes).map_err(|error| refused(error.to_string()))?;
        let watched = phase.watch(simulation.interrupt());
        let start = simulation.diagnose();
        Ok(Self {
            simulation,
            stepped,
            steps,
            elapsed: 0.0,
            work: Work::default(),
            taken: Taken::default(),
            start: start.total_energy(),
            now: start,
            max_stretch: start.max_stretch,
            told: 0.0,
            phase: phase.clone(),
            _watched: watched,
        })
    }

    /// Takes the steps of an interval; returns how long that took (s).
    pub(crate) fn advance(&mut self) -> Result<f64, End> {
        let begin = Instant::now();
        let taken = (0..self.steps).try_for_each(|_| self.step());
        let seconds = begin.elapsed().as_secs_f64();
        self.elapsed += seconds;
        taken.map(|()| seconds)
    }

    fn step(&mut self) -> Result<(), End> {
        let report = self.simulation.step(&mut NoStopwatch).map_err(|error| ended(&error, &self.phase))?;
        self.work = self.work.and(report.work);
        let steps = report.cloth.map_or([0; 2], |cloth| [cloth.substeps, cloth.rejected]).map(u64::from);
        let snow = report.snow.map_or(0, |snow| u64::from(snow.substeps));
        self.taken.substeps += steps[0] + snow;
        self.taken.rejected += steps[1];
        self.taken.indefinite += u64::from(report.notices.indefinite_solves);
        self.now = report.diagnostics;
        self.max_stretch = self.max_stretch.max(self.now.max_stretch);
        self.told = self.told.max(report.rest.map_or(0.0, |rest| rest.told));
        Ok(())
    }

    /// Where the particles of the scene are.
    pub(crate) fn positions(&self) -> Vec<f64> {
        self.stepped.gathered(self.read(Field::Positions))
    }

    /// What is compared of the case.
    pub(crate) fn observed(&self, case: &Case) -> Vec<f64> {
        case.observed(self.positions(), self.now.total_energy())
    }

    /// How fast they are.
    pub(crate) fn velocities(&self) -> Vec<f64> {
        self.read(Field::Velocities)
    }

    fn read(&self, field: Field) -> Vec<f64> {
        let mut numbers = vec![0.0; field.width() * self.simulation.particle_count()];
        self.simulation.read(field, &mut numbers);
        numbers
    }

    /// Seconds that its intervals took.
    pub(crate) const fn elapsed(&self) -> f64 {
        self.elapsed
    }

    /// Forces and products so far.
    pub(crate) const fn work(&self) -> Work {
        self.work
    }

    /// Simulated time (s).
    pub(crate) fn time(&self) -> f64 {
        self.simulation.time()
    }

    /// Steps of the world that were taken.
    pub(crate) fn step_count(&self) -> u64 {
        self.simulation.step_count()
    }

    /// The longest explicit step (s) that is certified at the state as it is.
    pub(crate) fn bound(&self) -> f64 {
        self.simulation.step_bounds().iter().map(|bound| bound.dt).fold(f64::INFINITY, f64::min)
    }
}

fn ended(error: &StepError, phase: &Phase) -> End {
    let refuses = matches!(
        error.failure,
        StepFailure::TimeStep { .. }
            | StepFailure::Substeps { .. }
            | StepFailure::NeverStable { .. }
            | StepFailure::Inaccurate { .. }
    );
    match error.failure {
        StepFailure::Interrupted => End::Cut(phase.cut()),
        _ => End::Failed(Failure {
            cause: error.failure.to_string(),
            time: error.time,
            particle: error.failure.particle(),
            is_refusal: refuses,
        }),
    }
}

/// Runs a setting to the last of the times, or until a phase is over. What fails is a result.
pub fn run(case: &Case, stepped: impl Into<Stepped>, times: &Times, phase: &Phase) -> Run {
    run_within(case, stepped.into(), times, phase, u64::MAX)
}

/// The same, given up as soon as it has taken more evaluations and products than these.
pub(crate) fn run_within(case: &Case, stepped: Stepped, times: &Times, phase: &Phase, most: u64) -> Run {
    driven(case, Runner::start(case, stepped, times, phase), (stepped, times), most)
}

/// The same within what the scene allows of its state and of its steps, as it runs when it is written so.
pub(crate) fn run_as_written(case: &Case, stepped: Stepped, times: &Times, phase: &Phase) -> Run {
    let plan = stepped.plan(case, times.interval).limited_as(case);
    driven(case, Runner::of_plan(case, stepped, plan, phase), (stepped, times), u64::MAX)
}

/// Takes what was started to the last of the times.
fn driven(
    case: &Case,
    started: Result<Runner, Failure>,
    (stepped, times): (Stepped, &Times),
    most: u64,
) -> Run {
    let mut run = Run {
        states: Vec::new(),
        seconds: Vec::new(),
        elapsed: 0.0,
        time: 0.0,
        tried: 0.0,
        work: Work::default(),
        dt: stepped.dt(times.interval).unwrap_or(case.dt()),
        energy_drift: 0.0,
        max_stretch: 0.0,
        told: 0.0,
        state_hash: 0,
        end: End::Reached,
    };
    let mut runner = match started {
        Ok(runner) => runner,
        Err(failure) => return Run { end: End::Failed(failure), ..run },
    };

    let mut marks = times.marks.iter().peekable();
    for interval in 1..=times.count() {
        match runner.advance() {
            Ok(seconds) => run.seconds.push(seconds),
            Err(end) => {
                run.end = end;
                break;
            }
        }
        if marks.next_if_eq(&&interval).is_some() {
            run.states.push(runner.observed(case));
        }
        if runner.work.force_evaluations + runner.work.matrix_products > most {
            run.end = End::Costly;
            break;
        }
    }

    if stepped.dt(times.interval).is_none() && runner.taken.substeps > 0 {
        run.dt = runner.simulation.time() / runner.taken.substeps as f64;
    }
    (run.elapsed, run.time) = (runner.elapsed, runner.simulation.time());
    let failed = if run.end == End::Reached { 0.0 } else { runner.simulation.dt() };
    run.tried = run.time + failed;
    run.energy_drift = runner.now.total_energy() - runner.start;
    (run.work, run.max_stretch, run.told) = (runner.work, runner.max_stretch, runner.told);
    run.state_hash = runner.simulation.state_hash();
    run
}
