//! A world in one precision: built from a setup, advanced step by step.

use std::sync::Arc;

use super::{
    body::Body,
    cloth::Cloth,
    rules::ChangeRules,
    setup::{SetupError, WorldSetup},
    snow::SnowBody,
};
use crate::{
    collide::Collider,
    interrupt::Interrupt,
    math::Real,
    report::{Diagnostics, StepError, StepReport, Stopwatch},
    surroundings::Surroundings,
};

/// Bodies, colliders, gravity and wind on one clock, in one precision.
#[derive(Clone, Debug)]
pub struct World<R: Real> {
    /// Time step (s).
    pub(super) dt: f64,
    pub(super) step_count: u64,
    pub(super) gravity: [f64; 3],
    pub(super) wind: [f64; 3],
    pub(super) colliders: Vec<Collider>,
    /// Cloths in the order of the setup, then the snow, which goes last: a cloth that fails has then
    /// not moved it.
    pub(super) bodies: Vec<Body<R>>,
    pub(super) rules: Arc<ChangeRules>,
    pub(super) interrupt: Interrupt,
}

impl<R: Real> World<R> {
    /// Builds a world; the strings are warnings that do not stop it.
    ///
    /// # Errors
    /// What is wrong with the setup, and where.
    pub fn new(setup: &WorldSetup) -> Result<(Self, Vec<String>), SetupError> {
        setup.check()?;
        let WorldSetup { dt, gravity, wind, colliders, bodies: cloths, snow } = setup;
        let (mut bodies, mut warnings, mut first_particle) = (Vec::new(), Vec::new(), 0);

        for cloth in cloths {
            let (cloth, notes) = Cloth::new(cloth, first_particle)?;
            first_particle += cloth.particle_count() as u32;
            bodies.push(Body::Cloth(Box::new(cloth)));
            warnings.extend(notes);
        }

        if let Some(snow) = snow {
            let (snow, notes) = SnowBody::new(snow, colliders, first_particle)?;
            bodies.push(Body::Snow(Box::new(snow)));
            warnings.extend(notes);
        }

        let (gravity, wind, colliders) = (*gravity, *wind, colliders.clone());
        let (rules, interrupt) = (Arc::new(ChangeRules::of(&bodies)), Interrupt::default());
        Ok((Self { dt: *dt, step_count: 0, gravity, wind, colliders, bodies, rules, interrupt }, warnings))
    }

    /// Takes one step, on the rayon pool that the caller installed.
    ///
    /// # Errors
    /// When a body's step fails: cloths are then as before the step, snow as after its last good
    /// step within it; the world takes no further step.
    pub fn step(&mut self, watch: &mut dyn Stopwatch) -> Result<StepReport, StepError> {
        let mut report = StepReport::default();
        let time = self.time();
        let Self { dt, gravity, wind, colliders, bodies, interrupt, .. } = self;
        let around = Surroundings { gravity: *gravity, wind: *wind, colliders, time, dt: *dt, interrupt };

        for index in 0..bodies.len() {
            match bodies[index].step(&around, watch) {
                Ok(body) => body.add_to(&mut report),
                Err(failure) => {
                    let body = bodies[index].name_for(&failure).to_owned();
                    let failure = failure.shifted(u64::from(bodies[index].first_particle()));
                    bodies[..=index].iter_mut().for_each(Body::undo);
                    return Err(StepError { step: self.step_count, time, body, failure });
                }
            }
        }

        self.step_count += 1;
        (report.step, report.time) = (self.step_count, self.time());
        Ok(report)
    }

    /// Diagnostics of the state as it is.
    pub fn diagnose(&self) -> Diagnostics {
        let Self { dt, gravity, wind, colliders, bodies, interrupt, .. } = self;
        let time = self.time();
        let around = Surroundings { gravity: *gravity, wind: *wind, colliders, time, dt: *dt, interrupt };
        let add = |total: Diagnostics, body: &Body<R>| total.with(&body.diagnose(&around));
        bodies.iter().fold(Diagnostics::default(), add)
    }

    /// What asks a step in progress to give up; the step then fails with [`StepFailure::Interrupted`].
    ///
    /// [`StepFailure::Interrupted`]: crate::report::StepFailure::Interrupted
    pub fn interrupt(&self) -> &Interrupt {
        &self.interrupt
    }

    /// Time step (s).
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Number of steps taken since the start.
    pub fn step_count(&self) -> u64 {
        self.step_count
    }

    /// Simulated time (s).
    pub fn time(&self) -> f64 {
        self.step_count as f64 * self.dt
    }
}
