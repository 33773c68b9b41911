//! A cloth as a body of a world: built, stepped, undone, changed, looked at.

use serde::{Deserialize, Serialize};

use std::{borrow::Cow, sync::Arc};

use xxhash_rust::xxh3::Xxh3;

use super::{
    forces::Acting,
    parameters::{ClothParameters, ranges},
    report::BodyReport,
    setup::{BodySetup, SetupError},
    topology::{BodyTopology, StepBound},
};
use crate::{
    cloth::{
        self, Air, ClothReport, ClothSettings, Gain, LawEntry, Model, Parameters, PathPoint, PinMotion,
        SpringKind, State, Stepping, Workspace,
    },
    linalg::PreconditionerKind,
    math::{Padded, Real, Sixteen, array3},
    parallel::{Ranks, hash_numbers, sum_hashes},
    report::{Diagnostics, ErrorEstimate, StepFailure},
    surroundings::Surroundings,
};

/// What further steps of a cloth depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub(super) struct Taken<R: Real> {
    state: State<R>,
    parameters: Parameters,
    /// Pins sent since the last step.
    sent: Vec<PinMotion>,
    /// Forces that calls have set (N), of each particle, or none.
    forces: Vec<[f64; 3]>,
}

/// Positions (m) and velocities (m/s) in the model's order, and parameters.
type Start<R> = ([Vec<Padded<R>>; 2], Parameters);

/// A cloth in a world.
#[derive(Clone, Debug)]
pub(super) struct Cloth<R: Real> {
    pub(super) name: String,
    /// Index of its first particle among all.
    pub(super) first_particle: u32,
    pub(super) model: Model<R>,
    pub(super) parameters: Parameters,
    settings: ClothSettings,
    pub(super) state: State<R>,
    pub(super) work: Workspace<R>,
    /// Pins sent since the last step, in the order in which they were sent.
    pub(super) sent: Vec<PinMotion>,
    /// For drawing, in the user's numbering of the body.
    triangles: Vec<[u32; 3]>,
    springs: Vec<[u32; 2]>,
    uv: Vec<[f64; 2]>,
    pub(super) acting: Acting,
    /// Its state and parameters at the start.
    pub(super) start: Arc<Start<R>>,
}

impl<R: Real> Cloth<R> {
    /// Builds a cloth, for steps of the world of `dt` (s); the strings are warnings that do not stop it.
    pub(super) fn new(
        setup: &BodySetup,
        dt: f64,
        first_particle: u32,
        ranks: Option<&Ranks>,
    ) -> Result<(Self, Vec<String>), SetupError> {
        let BodySetup { name, network, settings: asked, forces } = setup;
        let refused = |message| SetupError::Body { body: name.clone(), message };
        let mut settings = cloth::resolve(asked, network, dt);
        let made = match Model::over(network, &settings, ranks) {
            // What is too entangled for a coarse space goes without, where none is asked for by name.
            Err(_) if settings.solver.preconditioner != asked.solver.preconditioner => {
                settings.solver.preconditioner = PreconditionerKind::BlockJacobi;
                Model::over(network, &settings, ranks)
            }
            made => made,
        };
        let (model, parameters, warnings) = made.map_err(refused)?;
        let crossed = if network.thickness > 0.0 { network.crossed() } else { None };
        if let Some(crossed) = crossed {
            let message =
                format!("it has a thickness, and its surface crosses itself at the start: {crossed}");
            return Err(refused(message));
        }
        let state = State { x: model.arrange(&network.x), v: model.arrange(&network.v), ..State::default() };
        let start = Arc::new(([state.x.clone(), state.v.clone()], parameters.clone()));

        let mut cloth = Self {
            name: name.clone(),
            first_particle,
            model,
            parameters,
            settings,
            state,
            work: Workspace::new(),
            sent: Vec::new(),
            triangles: network.triangles.clone(),
            springs: network.springs.iter().map(|spring| spring.particles).collect(),
            uv: network.uv.clone(),
            acting: Acting::new(forces),
            start,
        };

        cloth.still_pins();
        let count = cloth.particle_count();
        let wrong =
            forces.iter().find_map(|force| force.invalid(count, |particle| cloth.is_pinned(particle)));
        if let Some(message) = wrong {
            return Err(SetupError::Body { body: name.clone(), message });
        }
        Ok((cloth, warnings.into_iter().map(|warning| format!("body '{name}': {warning}")).collect()))
    }

    /// A pin's velocity is prescribed: 0 until it is sent somewhere.
    pub(super) fn still_pins(&mut self) {
        let pinned = self.model.inv_m.iter().zip(&mut self.state.v).filter(|(inv_m, _)| **inv_m == R::zero());
        pinned.for_each(|(_, v)| *v = Padded::default());
    }

    /// Itself in the middle of a step.
    pub(super) fn stepping<'a>(&'a mut self, around: &'a Surroundings<'a>) -> Stepping<'a, R> {
        let Self { model, parameters, settings, state, work, .. } = self;
        Stepping { model, parameters, settings, around, state, work }
    }

    /// Length of the sub-steps that its scene asks for (s).
    pub(super) fn asked(&self, around: &Surroundings<'_>) -> f64 {
        self.settings.time_step.asked(around.dt)
    }

    /// Whether its steps are taken whatever is known of them.
    pub(super) fn is_unchecked(&self) -> bool {
        self.settings.time_step.is_unchecked()
    }

    /// By how much the sub-step that was tried last was longer than one that just meets the tolerance; none without
    /// tolerance.
    pub(super) fn strain(&self) -> Option<f64> {
        let order = f64::from(self.settings.integrator.order());
        let ratio = self.work.tried_error() / self.settings.tolerance?;
        Some(libm::pow(ratio, 1.0 / (order + 1.0)))
    }

    /// What its step told, as that of a body, the largest error of its sub-steps, and how many had no history.
    pub(super) fn told(&self, report: &ClothReport) -> (BodyReport, ErrorEstimate, u32) {
        let ClothReport {
            diagnostics,
            contact_count,
            solve,
            error,
            without_history,
            surface,
            mut notices,
            work,
            ..
        } = *report;
        let of_all = |particle: u64| particle + u64::from(self.first_particle);
        notices.first_passed = notices.first_passed.map(of_all);
        notices.first_pinched = notices.first_pinched.map(of_all);
        let snow = None;
        let body = BodyReport { diagnostics, contact_count, solve, surface, snow, notices, work };
        (body, error, without_history)
    }

    pub(super) fn undo(&mut self) {
        self.work.undo(&mut self.state);
    }

    /// What further steps depend on; whole on rank 0 of several.
    pub(super) fn take(&self) -> Taken<R> {
        let mut state = self.state.clone();
        state.gather(&self.model.share);
        let forces = self.acting.called().to_vec();
        Taken { state, parameters: self.parameters.clone(), sent: self.sent.clone(), forces }
    }

    /// Goes on from what was taken of the same cloth.
    ///
    /// # Panics
    /// If that was another one.
    pub(super) fn put(&mut self, taken: &Taken<R>) {
        assert_eq!(taken.state.x.len(), self.state.x.len(), "the state of the same cloth");
        let Taken { state, parameters, sent, forces } = taken.clone();
        self.acting.put(forces);
        (self.state, self.parameters, self.sent) = (state, parameters, sent);
        self.work.forget();
    }

    pub(super) fn diagnose(&self, around: &Surroundings<'_>) -> Diagnostics {
        cloth::diagnose(&self.model, &self.parameters, &self.settings, around, &self.state)
    }

    pub(super) fn particle_count(&self) -> usize {
        self.model.count
    }

    pub(super) fn spring_count(&self) -> usize {
        self.model.spring_count
    }

    pub(super) fn name_for(&self, _: &StepFailure) -> &str {
        &self.name
    }

    /// Whether any of its springs is of a kind; `None`: of any kind.
    pub(super) fn has_springs(&self, kind: Option<SpringKind>) -> bool {
        self.parameters.laws.iter().any(|law| kind.is_none_or(|kind| law.kind == kind))
    }

    /// Drag and springs as they are now.
    pub(super) fn parameters(&self) -> ClothParameters {
        let Parameters { laws, drag, air, .. } = &self.parameters;
        ClothParameters { name: self.name.clone(), drag: *drag, air: *air, springs: ranges(laws) }
    }

    /// Lets the next step go on from the state alone: forces change from one step to the next.
    pub(super) fn forget_past(&mut self) {
        self.state.past.dt = 0.0;
    }

    pub(super) fn set_drag(&mut self, drag: f64) {
        self.state.kept.forget();
        self.parameters.drag = drag;
    }

    /// Whether the air acts on it.
    pub(super) fn feels_air(&self) -> bool {
        self.parameters.air.is_some()
    }

    /// Changes the air around it, if it feels any.
    pub(super) fn change_air(&mut self, change: impl Fn(Air) -> Air) {
        self.state.kept.forget();
        self.parameters.air = self.parameters.air.map(change);
    }

    /// Sets stiffness (N/m) and damping (N s/m) of the springs of a kind; `None` leaves one as it is.
    pub(super) fn set_springs(
        &mut self,
        kind: Option<SpringKind>,
        stiffness: Option<f64>,
        damping: Option<f64>,
    ) {
        self.state.kept.forget();
        for entry in self.parameters.laws.iter_mut().filter(|entry| kind.is_none_or(|k| entry.kind == k)) {
            entry.law.stiffness = stiffness.unwrap_or(entry.law.stiffness);
            entry.law.damping = damping.unwrap_or(entry.law.damping);
        }
    }

    pub(super) fn is_pinned(&self, particle: u32) -> bool {
        let place = self.model.place.get(particle as usize);
        place.is_some_and(|place| self.model.inv_m[*place as usize] == R::zero())
    }

    /// Sends a pinned particle through `points`, each a time from now (s), growing, and a position (m); `dt` is the
    /// world's (s). It takes a step of the world to the first at least, and a sub-step to each other.
    pub(super) fn send_pin(&mut self, particle: u32, points: impl Iterator<Item = (f64, [f64; 3])>, dt: f64) {
        let particle = self.model.place[particle as usize];
        let substeps = self.settings.time_step.count_in(dt);
        let dt = dt / substeps;
        let (mut taken, mut least) = (0, substeps as u64);
        let points = points.map(|(time, target)| {
            // A time of a whole number of steps stays one when the quotient is rounded.
            let arrival = ((time / dt - 1e-9).ceil() as u64).max(taken + least);
            let steps = arrival - taken;
            (taken, least) = (arrival, 1);
            PathPoint { target, steps }
        });
        self.sent.push(PinMotion::along(particle, points.collect()));
    }

    /// Takes over the pins that were sent.
    pub(super) fn sort_pins(&mut self) {
        if !self.sent.is_empty() {
            merge_pins(&mut self.state.motions, &mut self.sent);
        }
    }

    /// Adds what may be changed between two steps to a hash: drag, air, laws of springs, and forces that calls have set.
    pub(super) fn hash_parameters(&self, hasher: &mut Xxh3) {
        let Parameters { laws, elements, drag, air } = &self.parameters;
        hasher.update(&drag.to_le_bytes());
        if let Some(air) = air {
            hasher.update(air.numbers().map(|(_, number)| number.to_le_bytes()).as_flattened());
        }
        for law in laws.iter().map(|LawEntry { law, .. }| law).chain(elements) {
            hasher.update([law.stiffness, law.damping].map(f64::to_le_bytes).as_flattened());
        }
        self.acting.called().as_flattened().iter().for_each(|c| hasher.update(&c.to_le_bytes()));
    }

    /// Wrapping sum of a hash per particle: position and velocity; where a solve starts from it the change of velocity of
    /// the step before, and where a step goes on from it the state before; of one per pin on its way; of what explicit
    /// steps gained; of how many solves ago one came to its cap, if one did, and of the set-up that is kept.
    pub(super) fn hash(&self) -> u64 {
        let State { x, v, dv, past, .. } = &self.state;
        let numbers = |vector: &Padded<R>| array3(&vector.vector());
        let is_warm = self.settings.integrator.is_implicit() && self.settings.solver.warm_start;
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

        let moving = self.motions();
        let pins = sum_hashes(&moving, |_, motion| {
            motion.hash(self.owner(self.model.user[motion.particle as usize]))
        });
        let Gain { energy, ratio, motion } = self.state.gain;
        let gained = if energy == 0.0 { 0 } else { hash_numbers(self.owner(0), [energy, ratio, motion]) };
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
        particles.wrapping_add(pins).wrapping_add(gained).wrapping_add(capped).wrapping_add(set_up)
    }

    /// Number among all particles of one of its own.
    fn owner(&self, user: u32) -> u64 {
        u64::from(self.first_particle + user)
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

    pub(super) fn topology(&self, out: &mut Vec<BodyTopology>) {
        let (first, count) = (self.first_particle, self.model.count as u32);
        out.push(BodyTopology {
            name: self.name.clone(),
            first_particle: first,
            particle_count: count,
            triangles: self.triangles.iter().map(|t| t.map(|p| p + first)).collect(),
            springs: self.springs.iter().map(|s| s.map(|p| p + first)).collect(),
            pins: (0..count).filter(|user| self.is_pinned(*user)).map(|user| user + first).collect(),
            uv: self.uv.clone(),
        });
    }

    /// Largest explicit step at the state as it is.
    pub(super) fn step_bound(&self, around: &Surroundings<'_>) -> StepBound {
        let Self { model, parameters, settings, state, .. } = self;
        let (dt, particle) = cloth::step_bound(model, parameters, settings, around, state);
        StepBound { body: self.name.clone(), dt, particle: u64::from(particle + self.first_particle) }
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
