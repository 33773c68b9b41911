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
    report::{Diagnostics, Load, NoStopwatch, StepError, StepFailure, StepReport, Stopwatch, Task},
    surroundings::Surroundings,
};

/// Bodies, colliders, gravity and wind on one clock, in one precision. What can be asked of it is said at `Simulation`.
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
    /// Builds a world, or what one of several ranks steps of it; the strings are warnings that do not stop it.
    ///
    /// # Errors
    /// What is wrong with the setup, and where.
    pub(crate) fn new(setup: &WorldSetup, ranks: Option<Ranks>) -> Result<(Self, Vec<String>), SetupError> {
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
            steps: 1.0,
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

    pub(crate) fn step(&mut self, watch: &mut dyn Stopwatch) -> Result<StepReport, StepError> {
        let loads = cleared(std::mem::take(&mut self.loads), self.colliders.len());
        let mut report = StepReport { loads, ..StepReport::default() };
        let before = self.pace;
        let Self { dt, gravity, wind, colliders, bodies, interrupt, pace, step_count, .. } = self;
        let time = *step_count as f64 * *dt;
        let wind = wind.at(time + 0.5 * *dt);
        let around =
            Surroundings { gravity: *gravity, wind, colliders, time, dt: *dt, steps: 1.0, interrupt };

        for cloth in bodies.iter_mut().filter_map(Body::as_cloth_mut) {
            cloth.renew_forces(time, around.dt);
            cloth.stir(&around, *step_count);
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

        for cloth in bodies.iter_mut().filter_map(Body::as_cloth_mut) {
            cloth.end_step(&around, *step_count + 1, watch, &mut report);
        }
        self.loads = report.loads.clone();
        self.count_step();
        (report.step, report.time) = (self.step_count, self.time());
        Ok(report)
    }

    /// Does the tasks of a step of each cloth by itself, at the state as it is, and calls `watch` with each once it is done: to be
    /// timed one by one, on the rayon pool that the caller installed. A step does several of them in one sweep, and does not
    /// call this.
    pub(crate) fn tasks(&self, watch: &mut dyn FnMut(Task)) {
        let around = self.around();
        self.bodies.iter().filter_map(Body::as_cloth).for_each(|cloth| cloth.tasks(&around, watch));
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
        Surroundings { gravity: *gravity, wind, colliders, time, dt: *dt, steps: 1.0, interrupt }
    }

    /// Memory of what changes have given it: ways of colliders and pins, forces, and pulls (bytes).
    pub(crate) fn changed_bytes(&self) -> usize {
        let ways = self.colliders.iter().map(Collider::way_bytes).sum::<usize>();
        ways + self.bodies.iter().map(Body::changed_bytes).sum::<usize>()
    }

    /// Bytes that pairs of surfaces take.
    pub(crate) fn pair_bytes(&self) -> usize {
        self.bodies.iter().filter_map(Body::as_cloth).map(|cloth| cloth.memory.pair_bytes()).sum()
    }

    /// Lets the pairs of surfaces of a cloth take so many bytes from now on: all that has a thickness is one.
    pub(crate) fn limit_pairs(&mut self, bytes: u64) {
        let cloths = self.bodies.iter_mut().filter_map(Body::as_cloth_mut);
        cloths.for_each(|cloth| cloth.memory.limit_pairs(bytes));
    }

    pub(crate) fn diagnose(&self) -> Diagnostics {
        let around = self.around();
        let add = |total: Diagnostics, body: &Body<R>| total.with(&body.diagnose(&around));
        self.bodies.iter().fold(Diagnostics::default(), add)
    }

    pub(crate) fn interrupt(&self) -> &Interrupt {
        self.ranks.as_ref().map_or(&self.interrupt, |ranks| &ranks.wanted)
    }

    pub(crate) fn dt(&self) -> f64 {
        self.dt
    }

    pub(crate) fn step_count(&self) -> u64 {
        self.step_count
    }

    pub(crate) fn time(&self) -> f64 {
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
