//! A cloth of a world, one body or all with a thickness: built, stepped, undone, changed, looked at.

use serde::{Deserialize, Serialize};

use std::{borrow::Cow, ops::Range, sync::Arc};

use xxhash_rust::xxh3::Xxh3;

use super::{
    parts::{Part, Parts},
    together::{Member, check_apart},
};
use crate::{
    cloth::{
        self, ClothReport, ClothSettings, Gain, Joined, LawEntry, Model, Parameters, PinMotion, State,
        StepMemory, Stepping, Watch,
    },
    linalg::PreconditionerKind,
    math::{Padded, Real, Sixteen, array3},
    parallel::{Ranks, hash_numbers, sum_hashes},
    report::{Diagnostics, StepFailure},
    surroundings::Surroundings,
    world::setup::{
        SetupError,
        forces::{Acting, TimedForce},
        pulls::{Held, Pulls},
        report::BodyReport,
        topology::{BodyTopology, StepBound},
    },
};

/// What further steps of a cloth depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub(crate) struct Taken<R: Real> {
    pub(crate) state: State<R>,
    pub(crate) parameters: Parameters,
    /// Pins sent since the last step.
    pub(crate) sent: Vec<PinMotion>,
    /// Forces that calls have set (N), of each particle, or none.
    pub(crate) forces: Vec<[f64; 3]>,
    pub(crate) pulls: Vec<Held>,
    /// What sleeps depends on it; where nothing may sleep, what later steps tell alone.
    pub(crate) watch: Option<Watch<R>>,
}

/// Positions (m) and velocities (m/s) in the model's order, and parameters.
type Start<R> = ([Vec<Padded<R>>; 2], Parameters);

/// A cloth in a world.
#[derive(Clone, Debug)]
pub(crate) struct Cloth<R: Real> {
    pub(crate) parts: Parts,
    pub(crate) model: Model<R>,
    pub(crate) parameters: Parameters,
    pub(crate) settings: ClothSettings,
    pub(crate) state: State<R>,
    pub(crate) memory: StepMemory<R>,
    /// Pins sent since the last step, in the order in which they were sent.
    pub(crate) sent: Vec<PinMotion>,
    pub(crate) acting: Acting,
    pub(crate) pulls: Pulls,
    /// How still it lies, where the scene asks for that, and whether it sleeps.
    pub(crate) watch: Option<Watch<R>>,
    /// Diagnostics of what sleeps, once they were asked for where it lies; they follow from the state.
    pub(crate) resting: Option<Diagnostics>,
    /// Its state and parameters at the start.
    pub(crate) start: Arc<Start<R>>,
}

impl<R: Real> Cloth<R> {
    /// Builds a cloth of bodies that are stepped alike, for steps of the world of `dt` (s); the strings are warnings that do
    /// not stop it.
    pub(crate) fn new(
        members: &[Member<'_>],
        dt: f64,
        ranks: Option<&Ranks>,
    ) -> Result<(Self, Vec<String>), SetupError> {
        for (body, _) in members {
            let sound = cloth::check_network(&body.network, &body.settings)
                .and_then(|()| cloth::check_rest::<R>(&body.network, &body.settings));
            sound.map_err(|message| SetupError::Body { body: body.name.clone(), message })?;
        }
        let joined = Joined::of(members.iter().map(|(body, _)| &body.network).collect());
        let (whole, asked) = (&*joined.whole, &members[0].0.settings);
        let mut settings = cloth::resolve(asked, whole, dt);
        let made = match Model::over(&joined, &settings, ranks) {
            // What is too entangled for a coarse space goes without, where none is asked for by name.
            Err(_) if settings.solver.preconditioner != asked.solver.preconditioner => {
                settings.solver.preconditioner = PreconditionerKind::BlockJacobi;
                Model::over(&joined, &settings, ranks)
            }
            made => made,
        };
        let (model, parameters) = made.map_err(|message| {
            let names: Vec<_> = members.iter().map(|(body, _)| body.name.as_str()).collect();
            SetupError::Body { body: names.join(", "), message }
        })?;
        check_apart(members, &joined)?;
        let part = |(part, laws): (usize, &Range<usize>)| {
            let (body, first_particle) = members[part];
            Part::new(body, first_particle, joined.particles(part), laws.clone())
        };
        let parts = Parts::new(model.laws_of_parts.iter().enumerate().map(part).collect());
        let state = State { x: model.arrange(&whole.x), v: model.arrange(&whole.v), ..State::default() };
        let start = Arc::new(([state.x.clone(), state.v.clone()], parameters.clone()));
        let watch = settings.rest.map(|_| Watch::new(&model, &state.x));

        let mut cloth = Self {
            parts,
            model,
            parameters,
            settings,
            state,
            memory: StepMemory::default(),
            sent: Vec::new(),
            acting: Acting::default(),
            pulls: Pulls::default(),
            watch,
            resting: None,
            start,
        };

        cloth.still_pins();
        cloth.acting = Acting::new(&cloth.forces_of(members)?);
        let warnings = members.iter().flat_map(|(body, _)| {
            let warnings = Model::<R>::warnings(&body.network).into_iter();
            warnings.map(move |warning| format!("body '{}': {warning}", body.name))
        });
        Ok((cloth, warnings.collect()))
    }

    /// The forces of its bodies, in the numbering of the cloth.
    fn forces_of(&self, members: &[Member<'_>]) -> Result<Vec<TimedForce>, SetupError> {
        let mut forces = Vec::new();
        for ((body, _), part) in members.iter().zip(self.parts.iter()) {
            let first = part.own.start;
            for force in &body.forces {
                if let Some(message) = force.invalid(part.count(), |own| self.is_pinned(first + own)) {
                    return Err(SetupError::Body { body: body.name.clone(), message });
                }
                forces.push(force.moved(first));
            }
        }
        Ok(forces)
    }

    /// A pin's velocity is prescribed: 0 until it is sent somewhere.
    pub(crate) fn still_pins(&mut self) {
        let pinned = self.model.inv_m.iter().zip(&mut self.state.v).filter(|(inv_m, _)| **inv_m == R::zero());
        pinned.for_each(|(_, v)| *v = Padded::default());
    }

    /// Itself in the middle of a step.
    pub(crate) fn stepping<'a>(&'a mut self, around: &'a Surroundings<'a>) -> Stepping<'a, R> {
        let Self { model, parameters, settings, state, memory, .. } = self;
        Stepping { model, parameters, settings, around, state, memory }
    }

    /// Length of the sub-steps that its scene asks for (s).
    pub(crate) fn asked(&self, around: &Surroundings<'_>) -> f64 {
        self.settings.time_step.asked(around.dt)
    }

    /// Whether its steps are taken whatever is known of them.
    pub(crate) fn is_unchecked(&self) -> bool {
        self.settings.time_step.is_unchecked()
    }

    /// By how much the sub-step that was tried last was longer than one that just meets the tolerance; none without
    /// tolerance.
    pub(crate) fn strain(&self) -> Option<f64> {
        let order = f64::from(self.settings.integrator.order());
        let ratio = self.memory.tried_error() / self.settings.tolerance?;
        Some(libm::pow(ratio, 1.0 / (order + 1.0)))
    }

    /// What its step told, as that of a body.
    pub(crate) fn told(&self, report: &ClothReport) -> BodyReport {
        let ClothReport { diagnostics, contact_count, solve, surface, mut notices, work, .. } = *report;
        let of_all = |own: u64| self.of_all(own);
        notices.first_passed = notices.first_passed.map(of_all);
        notices.first_pinched = notices.first_pinched.map(of_all);
        notices.first_yielding = notices.first_yielding.map(of_all);
        let snow = None;
        BodyReport { diagnostics, contact_count, solve, surface, snow, notices, work }
    }

    /// Memory of the ways of its pins, of the forces that calls have set, and of pulls (bytes).
    pub(crate) fn changed_bytes(&self) -> usize {
        let ways = self.state.motions.iter().chain(&self.sent).map(PinMotion::bytes).sum::<usize>();
        ways + size_of_val(self.acting.called()) + self.pulls.bytes()
    }

    /// Returns to the state before the step of the world; what sleeps has not taken one.
    pub(crate) fn undo(&mut self) {
        if self.is_awake() {
            self.memory.undo(&mut self.state);
        }
    }

    /// What further steps depend on; whole on rank 0 of several.
    pub(crate) fn take(&self) -> Taken<R> {
        let mut state = self.state.clone();
        state.gather(&self.model.share);
        Taken {
            state,
            parameters: self.parameters.clone(),
            sent: self.sent.clone(),
            forces: self.acting.called().to_vec(),
            pulls: self.pulls.held().to_vec(),
            watch: self.watch.clone(),
        }
    }

    /// Goes on from what was taken of the same cloth.
    ///
    /// # Panics
    /// If that was another one.
    pub(crate) fn put(&mut self, taken: &Taken<R>) {
        assert_eq!(taken.state.x.len(), self.state.x.len(), "the state of the same cloth");
        let Taken { state, parameters, sent, forces, pulls, watch } = taken.clone();
        self.acting.put(forces);
        self.pulls.put(pulls);
        (self.state, self.parameters, self.sent, self.watch) = (state, parameters, sent, watch);
        self.memory.forget();
        self.resting = None;
    }

    pub(crate) fn diagnose(&self, around: &Surroundings<'_>) -> Diagnostics {
        cloth::diagnose(&self.model, &self.parameters, &self.settings, around, &self.state)
    }

    pub(crate) fn particle_count(&self) -> usize {
        self.model.count
    }

    pub(crate) fn spring_count(&self) -> usize {
        self.model.spring_count
    }

    /// The body that the particle of a failure belongs to, or all of them.
    pub(crate) fn name_for(&self, failure: &StepFailure) -> &str {
        failure.particle().map_or(self.parts.names(), |own| self.parts.of(own as u32).name.as_str())
    }

    /// Number over all bodies of a particle.
    pub(crate) fn of_all(&self, own: u64) -> u64 {
        u64::from(self.parts.of_all(own as u32))
    }

    /// Sub-steps that its scene asks for in a step of the world of `dt` (s).
    pub(crate) fn substeps(&self, dt: f64) -> f64 {
        self.settings.time_step.count_in(dt)
    }

    /// Whether its solves begin from the change of velocity of the step before.
    pub(crate) fn starts_warm(&self) -> bool {
        self.settings.integrator.is_implicit() && self.settings.solver.warm_start
    }

    /// Lets the next step go on from the state alone: forces change from one step to the next.
    pub(crate) fn forget_past(&mut self) {
        self.state.past.dt = 0.0;
    }

    pub(crate) fn is_pinned(&self, particle: u32) -> bool {
        let place = self.model.place.get(particle as usize);
        place.is_some_and(|place| self.model.inv_m[*place as usize] == R::zero())
    }

    /// Takes over the pins that were sent.
    pub(crate) fn sort_pins(&mut self) {
        if !self.sent.is_empty() {
            merge_pins(&mut self.state.motions, &mut self.sent);
        }
    }

    /// Adds what may be changed between two steps to a hash: drag, air, laws of springs, forces that calls have set, and pulls.
    pub(crate) fn hash_parameters(&self, hasher: &mut Xxh3) {
        let Parameters { laws, elements, drag, air } = &self.parameters;
        hasher.update(&drag.to_le_bytes());
        if let Some(air) = air {
            hasher.update(air.numbers().map(|(_, number)| number.to_le_bytes()).as_flattened());
        }
        for law in laws.iter().map(|LawEntry { law, .. }| law).chain(elements) {
            hasher.update([law.stiffness, law.damping].map(f64::to_le_bytes).as_flattened());
        }
        let led_since = Some(self.state.led_since).filter(|time| *time > 0.0);
        let numbers = self.acting.called().as_flattened().iter().chain(&led_since);
        numbers.for_each(|number| hasher.update(&number.to_le_bytes()));
        self.pulls.hash(hasher);
    }

    /// Wrapping sum of a hash per particle: position and velocity; where a solve starts from it the change of velocity of
    /// the step before, and where a step goes on from it the state before; of one per pin on its way; of what explicit
    /// steps gained; of how many solves ago one came to its cap, if one did, and of the set-up that is kept; of
    /// how it sleeps, if it ever slept.
    pub(crate) fn hash(&self) -> u64 {
        let State { x, v, dv, past, .. } = &self.state;
        let numbers = |vector: &Padded<R>| array3(&vector.vector());
        let is_warm = self.starts_warm();
        let particles = sum_hashes(&self.model.user, |place, user| {
            let owner = self.owner(*user);
            let ([x, y, z], [vx, vy, vz]) = (numbers(&x[place]), numbers(&v[place]));
            let own = if is_warm {
                let start = dv.get(place / Sixteen::<R>::LANES).map(|dv| dv.get(place % Sixteen::<R>::LANES));
                let [dx, dy, dz] = start.map_or([0.0; 3], |dv| array3(&dv));
                hash_numbers(owner, [x, y, z, vx, vy, vz, dx, dy, dz])
            } else {
                hash_numbers(owner, [x, y, z, vx, vy, vz])
            };
            if past.dt > 0.0 {
                let ([x, y, z], [vx, vy, vz]) = (numbers(&past.x[place]), numbers(&past.v[place]));
                hash_numbers(own, [x, y, z, vx, vy, vz, past.dt])
            } else {
                own
            }
        });

        let pins = self.hash_pins();
        let Gain { energy, kept, ratio, motion } = self.state.gain;
        let gained =
            if energy == 0.0 { 0 } else { hash_numbers(self.owner(0), [energy, kept, ratio, motion]) };
        let since = self.state.since_cap;
        let capped = if since == 0 { 0 } else { hash_numbers(self.owner(0), [f64::from(since)]) };
        let kept = &self.state.kept;
        let set_up = if kept.positions().is_empty() {
            0
        } else {
            sum_hashes(&self.model.user, |place, user| {
                let made = hash_numbers(self.owner(*user), kept.numbers());
                hash_numbers(made, numbers(&kept.positions()[place]))
            })
        };
        let slept = self.watch.as_ref().map_or(0, |watch| watch.hash(self.owner(0)));
        let all = [particles, pins, gained, capped, set_up, slept];
        all.into_iter().fold(0, u64::wrapping_add)
    }

    /// Wrapping sum of a hash per pin on its way.
    pub(crate) fn hash_pins(&self) -> u64 {
        let moving = self.motions();
        sum_hashes(&moving, |_, motion| motion.hash(self.owner(self.model.user[motion.particle as usize])))
    }

    /// Number among all particles of one of its own.
    fn owner(&self, user: u32) -> u64 {
        u64::from(self.parts.of_all(user))
    }

    /// Pins on their way, those included that were sent since the last step.
    fn motions(&self) -> Cow<'_, [PinMotion]> {
        if self.sent.is_empty() {
            return Cow::Borrowed(&self.state.motions);
        }
        let (mut motions, mut sent) = (self.state.motions.clone(), self.sent.clone());
        merge_pins(&mut motions, &mut sent);
        Cow::Owned(motions)
    }

    pub(crate) fn topology(&self, out: &mut Vec<BodyTopology>) {
        let mass = |own: u32| self.model.m[self.model.place[own as usize] as usize].to_f64();
        out.extend(self.parts.iter().map(|part| part.topology(|own| self.is_pinned(own), mass)));
    }

    /// Largest explicit step at the state as it is.
    pub(crate) fn step_bound(&self, around: &Surroundings<'_>) -> StepBound {
        let Self { model, parameters, settings, state, .. } = self;
        let (dt, particle) = cloth::step_bound(model, parameters, settings, around, state);
        StepBound { body: self.parts.of(particle).name.clone(), dt, particle: self.owner(particle) }
    }
}

/// Adds pins that were sent: of each particle the last. All at once, so that work grows with their number and not with
/// its square.
fn merge_pins(motions: &mut Vec<PinMotion>, sent: &mut Vec<PinMotion>) {
    motions.append(sent);
    motions.reverse();
    motions.sort_by_key(|motion| motion.particle);
    motions.dedup_by_key(|motion| motion.particle);
}
