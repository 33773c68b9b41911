//! The world: gravity, wind, colliders and bodies on one clock.
//!
//! Reads a [`WorldSetup`] (binary64, the user's numbering); writes positions, reports, or the
//! reason why a step was not taken. [`Simulation`] is a world in a precision chosen at run time.

mod setup;
mod change;
mod view;
mod simulation;

pub use change::{Change, ChangeError};
pub use setup::{BodySetup, SetupError, WorldSetup};
pub use simulation::Simulation;
pub use view::{BodyTopology, StepBound};

use crate::{
    cloth::{self, ClothSettings, Model, Parameters, State, Surroundings, Workspace},
    collide::Collider,
    linalg::SolveReport,
    math::Real,
    report::{Diagnostics, StepError, StepReport, Stopwatch},
    snow::{self, Snow},
};

/// A body in a world.
#[derive(Debug)]
pub(crate) struct Body<R: Real> {
    name: String,
    /// Index of its first particle among all.
    first_particle: u32,
    model: Model<R>,
    parameters: Parameters,
    settings: ClothSettings,
    state: State<R>,
    work: Workspace<R>,
    /// For drawing, in the user's numbering of the body.
    triangles: Vec<[u32; 3]>,
    springs: Vec<[u32; 2]>,
    uv: Vec<[f64; 2]>,
}

/// Bodies, colliders, gravity and wind on one clock, in one precision.
#[derive(Debug)]
pub struct World<R: Real> {
    dt: f64,
    step_count: u64,
    gravity: [f64; 3],
    wind: [f64; 3],
    colliders: Vec<Collider>,
    bodies: Vec<Body<R>>,
    snow: Option<Snow<R>>,
}

impl<R: Real> World<R> {
    /// Builds a world; the strings are remarks that do not stop it.
    ///
    /// # Errors
    /// What is wrong with the setup, and where.
    pub fn new(setup: &WorldSetup) -> Result<(Self, Vec<String>), SetupError> {
        setup.check()?;
        let (mut bodies, mut remarks, mut first_particle) = (Vec::new(), Vec::new(), 0);
        for BodySetup { name, network, settings } in &setup.bodies {
            let (model, parameters, notes) = Model::new(network, settings)
                .map_err(|message| SetupError::Body { body: name.clone(), message })?;
            remarks.extend(notes.into_iter().map(|note| format!("body '{name}': {note}")));
            let state =
                State { x: model.arrange(&network.x), v: model.arrange(&network.v), ..State::default() };
            let count = model.count as u32;
            bodies.push(Body {
                name: name.clone(),
                first_particle,
                model,
                parameters,
                settings: *settings,
                state,
                work: Workspace::new(),
                triangles: network.triangles.clone(),
                springs: network.springs.iter().map(|spring| spring.particles).collect(),
                uv: network.uv.clone(),
            });
            first_particle += count;
        }
        bodies.iter_mut().for_each(Body::still_pins);
        let snow = match &setup.snow {
            None => None,
            Some(snow) => {
                let (snow, notes) = Snow::new(snow)?;
                snow.check_step(&setup.colliders)?;
                remarks.extend(notes);
                Some(snow)
            }
        };
        let WorldSetup { dt, gravity, wind, colliders, .. } = setup;
        let world = Self {
            dt: *dt,
            step_count: 0,
            gravity: *gravity,
            wind: *wind,
            colliders: colliders.clone(),
            bodies,
            snow,
        };
        Ok((world, remarks))
    }

    /// Takes one step, on the rayon pool that the caller installed.
    ///
    /// # Errors
    /// When a body's step fails: cloths are then as before the step, snow as after its last good
    /// step within it; the world takes no further step.
    pub fn step(&mut self, watch: &mut dyn Stopwatch) -> Result<StepReport, StepError> {
        let mut report = StepReport::default();
        for index in 0..self.bodies.len() {
            match self.step_body(index, watch) {
                Ok(body) => merge(&mut report, &body),
                Err(failure) => {
                    let error = self.error_of(index, failure);
                    self.bodies[..=index].iter_mut().for_each(Body::undo);
                    return Err(error);
                }
            }
        }
        self.step_snow(&mut report, watch)?;
        self.step_count += 1;
        (report.step, report.time) = (self.step_count, self.time());
        Ok(report)
    }

    fn step_body(
        &mut self,
        index: usize,
        watch: &mut dyn Stopwatch,
    ) -> Result<cloth::ClothReport, crate::report::StepFailure> {
        let time = self.time();
        let Self { dt, gravity, wind, colliders, bodies, .. } = self;
        let around = Surroundings { gravity: *gravity, wind: *wind, colliders, time, dt: *dt };
        let Body { model, parameters, settings, state, work, .. } = &mut bodies[index];
        work.before.copy_from(state);
        cloth::step(model, parameters, settings, &around, state, work, watch)
    }

    /// Snow goes last: a cloth that fails has then not moved it.
    fn step_snow(&mut self, report: &mut StepReport, watch: &mut dyn Stopwatch) -> Result<(), StepError> {
        let (time, first) = (self.time(), self.cloth_count());
        let Self { dt, gravity, colliders, snow: Some(snow), .. } = self else { return Ok(()) };
        let around = snow::Surroundings { gravity: *gravity, colliders, time, dt: *dt };
        match snow.step(&around, watch) {
            Ok(step) => {
                report.diagnostics = report.diagnostics.with(&step.diagnostics);
                report.contact_count += step.contact_count;
                report.snow = Some(step.report.shifted(first as u64));
                keep_worse(report, step.solve);
                Ok(())
            }
            Err(failure) => {
                let body = failure.particle().map_or("snow", |particle| snow.object_of(particle)).to_owned();
                self.bodies.iter_mut().for_each(Body::undo);
                let failure = failure.shifted(first as u64);
                Err(StepError { step: self.step_count, time, body, failure })
            }
        }
    }

    fn error_of(&self, index: usize, failure: crate::report::StepFailure) -> StepError {
        let body = &self.bodies[index];
        StepError {
            step: self.step_count,
            time: self.time(),
            body: body.name.clone(),
            failure: failure.shifted(u64::from(body.first_particle)),
        }
    }

    /// Figures of the state as it is.
    pub fn diagnose(&self) -> Diagnostics {
        let around = Surroundings {
            gravity: self.gravity,
            wind: self.wind,
            colliders: &self.colliders,
            time: self.time(),
            dt: self.dt,
        };
        let cloths = self.bodies.iter().fold(Diagnostics::default(), |total, body| {
            total.with(&cloth::diagnose(&body.model, &body.parameters, &around, &body.state))
        });
        self.snow.iter().fold(cloths, |total, snow| total.with(&snow.diagnose(self.gravity)))
    }

    /// Simulated time (s).
    pub fn time(&self) -> f64 {
        self.step_count as f64 * self.dt
    }

    /// The body and the place in it of a user's particle.
    fn find(&self, particle: u32) -> Option<(usize, u32)> {
        let body = self.bodies.iter().rposition(|body| body.first_particle <= particle)?;
        let place =
            *self.bodies[body].model.place.get((particle - self.bodies[body].first_particle) as usize)?;
        Some((body, place))
    }
}

impl<R: Real> Body<R> {
    /// A pin's velocity is prescribed: 0 until it is sent somewhere.
    fn still_pins(&mut self) {
        let pinned = self.model.inv_m.iter().zip(&mut self.state.v).filter(|(inv_m, _)| **inv_m == R::zero());
        pinned.for_each(|(_, v)| v.fill(R::zero()));
    }

    fn undo(&mut self) {
        self.state.copy_from(&self.work.before);
    }
}

/// Adds a body's report to that of the world.
fn merge(report: &mut StepReport, body: &cloth::ClothReport) {
    report.diagnostics = report.diagnostics.with(&body.diagnostics);
    report.contact_count += body.contact_count;
    keep_worse(report, body.solve);
}

/// Keeps the solve with the larger residual.
fn keep_worse(report: &mut StepReport, solve: Option<SolveReport>) {
    let worse =
        |new: &SolveReport| report.solve.is_none_or(|old| new.relative_residual >= old.relative_residual);
    if let Some(solve) = solve.filter(worse) {
        report.solve = Some(solve);
    }
}
