//! A world in one precision: built from a setup, advanced step by step.

mod division;
pub(crate) mod pace;
mod cloths;
pub(crate) mod carried;
pub(crate) mod begin;

use std::sync::Arc;

use cloths::Failure;
use pace::Pace;

use super::{
    body::{Body, cloth::Cloth, snow::SnowBody, together::groups},
    calls::{figures, rules::ChangeRules},
    setup::{SetupError, WorldSetup, wind::Wind},
};
use crate::{
    collide::{Collider, Motion, cleared},
    interrupt::Interrupt,
    math::Real,
    parallel::Ranks,
    report::{Diagnostics, Load, NoStopwatch, RestReport, StepError, StepFailure, StepReport, Stopwatch},
    surroundings::Surroundings,
};

/// Bodies, colliders, gravity and wind on one clock, in one precision.
#[derive(Clone, Debug)]
pub struct World<R: Real> {
    /// Time step (s).
    pub(crate) dt: f64,
    pub(crate) step_count: u64,
    pub(crate) gravity: [f64; 3],
    pub(crate) wind: Wind,
    pub(crate) colliders: Vec<Collider>,
    /// Cloths in the order of the setup, all with a thickness as one where the first of them stands; then
    /// the snow, which goes last: a cloth that fails has then not moved it.
    pub(crate) bodies: Vec<Body<R>>,
    /// How long the sub-steps of the cloths are.
    pub(crate) pace: Pace,
    pub(crate) rules: Arc<ChangeRules>,
    /// Gravity, wind, and how colliders move at the start.
    pub(crate) start: ([f64; 3], Wind, Vec<Motion>),
    /// What its steps obey.
    pub(crate) interrupt: Interrupt,
    /// Those of the step before, to be written again once nobody else holds them.
    pub(crate) loads: Arc<[Load]>,
    /// The ranks that step it together; none where one does.
    pub(crate) ranks: Option<Ranks>,
}

impl<R: Real> World<R> {
    /// Builds a world; the strings are warnings that do not stop it.
    ///
    /// # Errors
    /// What is wrong with the setup, and where.
    pub fn new(setup: &WorldSetup) -> Result<(Self, Vec<String>), SetupError> {
        Self::over(setup, None)
    }

    /// The same for one of several ranks.
    pub(crate) fn over(setup: &WorldSetup, ranks: Option<Ranks>) -> Result<(Self, Vec<String>), SetupError> {
        setup.check()?;
        figures::check(&setup.bodies)?;
        if ranks.is_some() {
            setup.check_for_ranks()?;
        }
        let WorldSetup { dt, gravity, wind, wind_at, colliders, bodies: cloths, snow } = setup;
        let (mut bodies, mut warnings) = (Vec::new(), Vec::new());

        for members in groups(cloths)? {
            let (cloth, notes) = Cloth::new(&members, *dt, ranks.as_ref())?;
            bodies.push(Body::Cloth(Box::new(cloth)));
            warnings.extend(notes);
        }

        if let Some(snow) = snow {
            let first_particle: u32 = cloths.iter().map(|cloth| cloth.network.x.len() as u32).sum();
            let (snow, notes) = SnowBody::new(snow, colliders, first_particle, ranks.as_ref())?;
            bodies.push(Body::Snow(Box::new(snow)));
            warnings.extend(notes);
        }

        let (gravity, wind, colliders) = (*gravity, Wind::new(*wind, wind_at), colliders.clone());
        let motions = colliders.iter().map(Collider::motion).collect();
        let start = (gravity, wind.clone(), motions);
        let rules = Arc::new(ChangeRules::of(&bodies, &colliders, *dt, ranks.as_ref()));
        let interrupt = ranks.as_ref().map_or_else(Interrupt::default, |ranks| ranks.agreed.clone());
        let (dt, pace) = (*dt, Pace::default());
        let mut world = Self {
            dt,
            step_count: 0,
            gravity,
            wind,
            colliders,
            bodies,
            pace,
            rules,
            start,
            interrupt,
            loads: Arc::default(),
            ranks,
        };
        world.check_steps()?;
        Ok((world, warnings))
    }

    /// Refuses steps of cloth that cannot be taken from the start.
    fn check_steps(&mut self) -> Result<(), SetupError> {
        let Self { dt, gravity, wind, colliders, bodies, interrupt, .. } = self;
        let around = Surroundings {
            gravity: *gravity,
            wind: wind.at(0.5 * *dt),
            colliders,
            time: 0.0,
            dt: *dt,
            interrupt,
        };
        for body in bodies.iter_mut() {
            let name = body.name_for(&StepFailure::Interrupted).to_owned();
            if let Some(cloth) = body.as_cloth_mut() {
                let mut stepping = cloth.stepping(&around);
                stepping.begin();
                let bound = stepping.bound(&mut NoStopwatch);
                bound.map_err(|failure| SetupError::Body { body: name, message: failure.to_string() })?;
            }
        }
        Ok(())
    }

    /// Takes one step, on the rayon pool that the caller installed.
    ///
    /// # Errors
    /// When a body's step fails: cloths are then as before the step, snow as after its last good
    /// step within it; the world takes no further step.
    pub fn step(&mut self, watch: &mut dyn Stopwatch) -> Result<StepReport, StepError> {
        let loads = cleared(std::mem::take(&mut self.loads), self.colliders.len());
        let mut report = StepReport { loads, ..StepReport::default() };
        let before = self.pace;
        let Self { dt, gravity, wind, colliders, bodies, interrupt, pace, step_count, .. } = self;
        let time = *step_count as f64 * *dt;
        let wind = wind.at(time + 0.5 * *dt);
        let around = Surroundings { gravity: *gravity, wind, colliders, time, dt: *dt, interrupt };

        for cloth in bodies.iter_mut().filter_map(Body::as_cloth_mut) {
            cloth.renew_forces(time, around.dt);
        }
        let taken = cloths::step(bodies, pace, &around, &mut report, watch)
            .and_then(|()| step_snow(bodies, &around, &mut report, watch));
        if let Err((index, failure)) = taken {
            let body = bodies[index].name_for(&failure).to_owned();
            let failure = failure.renumbered(|own| bodies[index].of_all(own));
            bodies.iter_mut().for_each(Body::undo);
            self.pace = before;
            return Err(StepError { step: self.step_count, time, body, failure });
        }

        for cloth in self.bodies.iter_mut().filter_map(Body::as_cloth_mut) {
            let told = cloth.look_at_rest(self.dt);
            report.rest = told.into_iter().chain(report.rest).reduce(RestReport::with);
        }
        self.loads = report.loads.clone();
        self.count_step();
        (report.step, report.time) = (self.step_count, self.time());
        Ok(report)
    }

    /// Counts a step that was taken: pulls end with it.
    pub(crate) fn count_step(&mut self) {
        self.step_count += 1;
        self.bodies.iter_mut().filter_map(Body::as_cloth_mut).for_each(Cloth::pass_pulls);
    }

    /// What surrounds bodies in the next step.
    pub(crate) fn around(&self) -> Surroundings<'_> {
        let Self { dt, gravity, wind, colliders, interrupt, .. } = self;
        let time = self.time();
        let wind = wind.at(time + 0.5 * *dt);
        Surroundings { gravity: *gravity, wind, colliders, time, dt: *dt, interrupt }
    }

    /// Memory of what changes have given it: ways of colliders and pins, forces, and pulls (bytes).
    pub(crate) fn changed_bytes(&self) -> usize {
        let ways = self.colliders.iter().map(Collider::way_bytes).sum::<usize>();
        ways + self.bodies.iter().map(Body::changed_bytes).sum::<usize>()
    }

    /// Bytes that pairs of surfaces take.
    pub(crate) fn pair_bytes(&self) -> usize {
        self.bodies.iter().filter_map(Body::as_cloth).map(Cloth::pair_bytes).sum()
    }

    /// Lets the pairs of surfaces of a cloth take so many bytes from now on: all that has a thickness is one.
    pub(crate) fn limit_pairs(&mut self, bytes: u64) {
        self.bodies.iter_mut().filter_map(Body::as_cloth_mut).for_each(|cloth| cloth.limit_pairs(bytes));
    }

    /// Diagnostics of the state as it is.
    pub fn diagnose(&self) -> Diagnostics {
        let around = self.around();
        let add = |total: Diagnostics, body: &Body<R>| total.with(&body.diagnose(&around));
        self.bodies.iter().fold(Diagnostics::default(), add)
    }

    /// What asks a step in progress to give up; the step then fails with [`StepFailure::Interrupted`].
    ///
    /// [`StepFailure::Interrupted`]: crate::report::StepFailure::Interrupted
    pub fn interrupt(&self) -> &Interrupt {
        self.ranks.as_ref().map_or(&self.interrupt, |ranks| &ranks.wanted)
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

/// Takes a step of the world with the snow among the bodies, and adds to its report.
fn step_snow<R: Real>(
    bodies: &mut [Body<R>],
    around: &Surroundings<'_>,
    report: &mut StepReport,
    watch: &mut dyn Stopwatch,
) -> Result<(), Failure> {
    for index in 0..bodies.len() {
        if let Some(snow) = bodies[index].as_snow_mut() {
            snow.step(around, watch).map_err(|failure| (index, failure))?.add_to(report);
            if let Some(loads) = Arc::get_mut(&mut report.loads) {
                snow.snow.add_to(around, loads);
            }
        }
    }
    Ok(())
}
