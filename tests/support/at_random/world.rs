//! The world of a case, which laws change, and what comes of a run.

use nappe_sim::{
    math::Precision,
    report::{NoStopwatch, StepFailure, StepReport},
    world::{Change, Simulation, WorldSetup},
};

use crate::{
    scene::{positions, velocities},
    threads::on_one_thread,
};

/// What a case is built into, and how long it runs.
#[derive(Clone, Debug)]
pub struct World {
    /// What the simulation is built from.
    pub setup: WorldSetup,
    /// Changes before the first step.
    pub changes: Vec<Change>,
    /// Precision of the state.
    pub precision: Precision,
    /// Steps until it ends.
    pub steps: u64,
}

/// What is seen of a state.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Positions (m).
    pub x: Vec<[f64; 3]>,
    /// Velocities (m/s).
    pub v: Vec<[f64; 3]>,
    /// What the step told that led here; nothing at the start.
    pub report: StepReport,
}

/// Frames of a run, and why it ended before its time, if it did.
#[derive(Clone, Debug)]
pub struct Run {
    /// That of the start, and one after each step.
    pub frames: Vec<Frame>,
    /// Why a step could not be taken.
    pub end: Option<StepFailure>,
}

impl Frame {
    /// What a simulation shows.
    pub fn of(simulation: &Simulation, report: StepReport) -> Self {
        Self { x: positions(simulation), v: velocities(simulation), report }
    }
}

impl Run {
    /// The kind of its end.
    pub fn reason(&self) -> String {
        let text = self.end.as_ref().map_or_else(|| "ran".to_owned(), |failure| format!("{failure:?}"));
        text.split([' ', '{', '(']).next().unwrap_or_default().to_owned()
    }
}

impl World {
    /// Its simulation before the first step, with the changes made.
    ///
    /// # Errors
    /// What is refused, in words.
    pub fn begin(&self) -> Result<Simulation, String> {
        on_one_thread(|| {
            let (mut simulation, _) =
                Simulation::new(&self.setup, self.precision).map_err(|error| error.to_string())?;
            simulation.apply(&self.changes).map_err(|error| error.to_string())?;
            Ok(simulation)
        })
    }

    /// Runs it to its end.
    ///
    /// # Errors
    /// See [`Self::begin`].
    pub fn run(&self) -> Result<Run, String> {
        let mut simulation = self.begin()?;
        let report = StepReport { diagnostics: simulation.diagnose(), ..StepReport::default() };
        let mut run = Run { frames: vec![Frame::of(&simulation, report)], end: None };
        go_on(&mut simulation, self.steps, &mut run);
        Ok(run)
    }

    /// Runs it as far as so much work goes: evaluations of forces and products with matrices, each of as many as there are particles. Returns
    /// the world of so many steps with it.
    ///
    /// # Errors
    /// See [`Self::begin`].
    pub fn run_within(&self, work: u64) -> Result<(Self, Run), String> {
        let mut simulation = self.begin()?;
        let report = StepReport { diagnostics: simulation.diagnose(), ..StepReport::default() };
        let mut run = Run { frames: vec![Frame::of(&simulation, report)], end: None };
        let (mut left, mut steps) = (work / simulation.particle_count() as u64, self.steps);
        for step in 0..self.steps {
            go_on(&mut simulation, 1, &mut run);
            let Some(frame) = run.frames.last().filter(|_| run.end.is_none()) else { break };
            let spent = frame.report.work.force_evaluations + frame.report.work.matrix_products;
            left = left.saturating_sub(spent);
            if left == 0 {
                steps = step + 1;
                break;
            }
        }
        Ok((Self { steps, ..self.clone() }, run))
    }

    /// Length of the run (s).
    pub fn duration(&self) -> f64 {
        self.setup.dt * self.steps as f64
    }

    /// The most that any two particles are apart at the start along an axis (m).
    pub fn size(&self) -> f64 {
        let cloth = self.setup.bodies.iter().flat_map(|body| &body.network.x);
        let snow = self.setup.snow.iter().flat_map(|snow| &snow.objects).flat_map(|object| &object.x);
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for x in cloth.chain(snow) {
            for c in 0..3 {
                (low[c], high[c]) = (low[c].min(x[c]), high[c].max(x[c]));
            }
        }
        (0..3).map(|c| high[c] - low[c]).fold(0.0, f64::max)
    }
}

/// Takes so many steps of a run more, or as many as can be taken.
pub fn go_on(simulation: &mut Simulation, steps: u64, run: &mut Run) {
    on_one_thread(|| {
        for _ in 0..steps {
            match simulation.step(&mut NoStopwatch) {
                Ok(report) => run.frames.push(Frame::of(simulation, report)),
                Err(error) => {
                    run.end = Some(error.failure);
                    break;
                }
            }
        }
    });
}
