//! What further steps of a world depend on: taken from one simulation, put into another of its setup.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{
    body::{
        Body,
        cloth::{Cloth, Taken},
    },
    clock::{World, pace::Pace},
    setup::wind::Wind,
    simulation::Simulation,
};
use crate::{
    collide::{Collider, Motion},
    field::Field,
    math::{Precision, Real, bytes},
    snow::{Snow, TakenSnow},
};

/// Steps of a state, at most: with more, times would no longer be exact.
const MOST_STEPS: u64 = 1 << 53;

/// What further steps depend on. Of a simulation that several ranks step, that of rank 0 is whole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WorldState(Precise);

/// A state that a simulation cannot go on from.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum StateError {
    #[error("the state is not in {needed}, in which the simulation is")]
    Precision { needed: Precision },
    #[error("the state has {found} {what}: the simulation has {needed}")]
    Count { what: &'static str, found: usize, needed: usize },
    #[error("the state of {part}: {message}")]
    Part { part: String, message: String },
}

impl StateError {
    fn of(part: &str, message: String) -> Self {
        Self::Part { part: part.to_owned(), message }
    }
}

/// A field of all bodies, of snow its positions alone, as bytes: what a look at a simulation needs. Of a simulation that several ranks step, that of
/// rank 0 is whole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TakenField {
    field: Field,
    cloths: Vec<AsBytes>,
    /// Of snow; its positions alone.
    snow: Option<AsBytes>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct AsBytes(#[serde(with = "bytes::raw")] Vec<u8>);

/// The same in one precision.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Precise {
    F32(State<f32>),
    F64(State<f64>),
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
struct State<R: Real> {
    step_count: u64,
    gravity: [f64; 3],
    wind: Wind,
    /// How the colliders move.
    motions: Vec<Motion>,
    pace: Pace,
    cloths: Vec<Taken<R>>,
    snow: Option<TakenSnow>,
}

impl<R: Real> World<R> {
    fn take(&self) -> State<R> {
        let cloths = self.bodies.iter().filter_map(|body| Some(body.as_cloth()?.take())).collect();
        let Self { step_count, gravity, pace, .. } = *self;
        let wind = self.wind.clone();
        let snow = self.snow().map(Snow::take);
        let motions = self.colliders.iter().map(Collider::motion).collect();
        State { step_count, gravity, wind, motions, pace, cloths, snow }
    }

    /// Whether it can go on from a state, of which nobody may know who wrote it.
    fn check_state(&self, state: &State<R>) -> Result<(), StateError> {
        let State { step_count, gravity, wind, motions, pace, cloths, snow } = state;
        let own: Vec<&Cloth<R>> = self.bodies.iter().filter_map(Body::as_cloth).collect();
        let counts = [
            ("cloths", cloths.len(), own.len()),
            ("bodies of snow", usize::from(snow.is_some()), usize::from(self.snow().is_some())),
            ("ways of colliders", motions.len(), self.colliders.len()),
        ];
        if let Some((what, found, needed)) = counts.into_iter().find(|(_, found, needed)| found != needed) {
            return Err(StateError::Count { what, found, needed });
        }

        if *step_count > MOST_STEPS {
            let message = format!("{step_count} steps were taken: at most {MOST_STEPS} are allowed");
            return Err(StateError::of("the world", message));
        }
        if gravity.iter().any(|c| !c.is_finite()) {
            return Err(StateError::of("the world", format!("gravity is not finite: {gravity:?}")));
        }
        if let Some(message) = wind.unsound() {
            return Err(StateError::of("the world", message));
        }
        if Pace::of_numbers(pace.all_numbers()) != Some(*pace) {
            return Err(StateError::of("the world", format!("no sub-step follows from {pace:?}")));
        }

        for (collider, motion) in self.colliders.iter().zip(motions) {
            if let Some(message) = motion.unsound() {
                return Err(StateError::of(&format!("collider '{}'", collider.name), message));
            }
        }
        for (cloth, taken) in own.into_iter().zip(cloths) {
            if let Some(message) = cloth.unfit(taken) {
                return Err(StateError::of(&format!("body '{}'", cloth.parts.names()), message));
            }
        }
        let unfit = self.snow().zip(snow.as_ref()).and_then(|(snow, taken)| snow.unfit(taken));
        unfit.map_or(Ok(()), |message| Err(StateError::of("the snow", message)))
    }

    fn put(&mut self, state: &State<R>) {
        let State { step_count, gravity, wind, motions, pace, cloths, snow } = state;
        (self.step_count, self.gravity, self.pace) = (*step_count, *gravity, *pace);
        self.wind.clone_from(wind);
        let own = self.colliders.iter_mut().zip(motions);
        own.for_each(|(collider, motion)| collider.put_motion(motion));
        let own = self.bodies.iter_mut().filter_map(|body| body.as_cloth_mut());
        own.zip(cloths).for_each(|(cloth, taken)| cloth.put(taken));
        self.snow_mut().into_iter().zip(snow).for_each(|(snow, taken)| snow.put(taken));
    }
}

impl<R: Real> World<R> {
    fn take_field(&self, field: Field) -> TakenField {
        let cloths = self.bodies.iter().filter_map(|body| body.as_cloth());
        let cloths = cloths.map(|cloth| AsBytes(cloth.take_field(field))).collect();
        let snow = self.snow().filter(|_| field == Field::Positions);
        TakenField { field, cloths, snow: snow.map(|snow| AsBytes(snow.take_positions())) }
    }

    fn put_field(&mut self, TakenField { field, cloths, snow }: &TakenField) {
        let own = self.bodies.iter_mut().filter_map(|body| body.as_cloth_mut());
        own.zip(cloths).for_each(|(cloth, AsBytes(taken))| cloth.put_field(*field, taken));
        self.snow_mut().into_iter().zip(snow).for_each(|(snow, AsBytes(taken))| snow.put_positions(taken));
    }
}

impl WorldState {
    /// Checks that a simulation can go on from it, which nothing is known of: its lengths, indices and numbers, but for what it
    /// takes to say whether such a state is one that steps come to.
    ///
    /// # Errors
    /// The first thing in it that does not fit.
    pub fn check(&self, simulation: &Simulation) -> Result<(), StateError> {
        match (simulation, &self.0) {
            (Simulation::F32(world), Precise::F32(state)) => world.check_state(state),
            (Simulation::F64(world), Precise::F64(state)) => world.check_state(state),
            _ => Err(StateError::Precision { needed: simulation.precision() }),
        }
    }

    /// Steps that were taken until then.
    pub fn step_count(&self) -> u64 {
        match &self.0 {
            Precise::F32(state) => state.step_count,
            Precise::F64(state) => state.step_count,
        }
    }

    /// Precision of its numbers.
    pub const fn precision(&self) -> Precision {
        match &self.0 {
            Precise::F32(_) => Precision::F32,
            Precise::F64(_) => Precision::F64,
        }
    }
}

impl Simulation {
    /// What further steps depend on. All ranks that step it call this together.
    pub fn take(&self) -> WorldState {
        WorldState(match self {
            Self::F32(world) => Precise::F32(world.take()),
            Self::F64(world) => Precise::F64(world.take()),
        })
    }

    /// Counts a step that was taken elsewhere, of which the state is not here yet: [`Self::put`] brings it.
    pub fn count_step(&mut self) {
        match self {
            Self::F32(world) => world.count_step(),
            Self::F64(world) => world.count_step(),
        }
    }

    /// A field of its bodies, of snow its positions alone. All ranks that step it call this together, with the same field.
    pub fn take_field(&self, field: Field) -> TakenField {
        match self {
            Self::F32(world) => world.take_field(field),
            Self::F64(world) => world.take_field(field),
        }
    }

    /// Takes over a field of another simulation of the same setup, to be looked at: no step goes on from it before
    /// [`Self::put`].
    ///
    /// # Panics
    /// If the setup or the precision was another one.
    pub fn put_field(&mut self, taken: &TakenField) {
        match self {
            Self::F32(world) => world.put_field(taken),
            Self::F64(world) => world.put_field(taken),
        }
    }

    /// Goes on from what was taken of another simulation of the same setup: with the same hash, and the same bits from there.
    ///
    /// # Panics
    /// If it is a state that [`WorldState::check`] refuses.
    pub fn put(&mut self, state: &WorldState) {
        match (self, &state.0) {
            (Self::F32(world), Precise::F32(state)) => world.put(state),
            (Self::F64(world), Precise::F64(state)) => world.put(state),
            _ => panic!("the state of a simulation in another precision"),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{
        cloth::{ClothSettings, Network, Spring, SpringKind, SpringLaw},
        collide::{Contact, StartInside, Way, shape::Plane},
        math::{Padded, Sixteen},
        report::NoStopwatch,
        world::{
            calls::{
                changes::Change,
                collider_move::{ColliderMove, MoveKey},
            },
            setup::{BodySetup, WorldSetup, forces::Forces},
        },
    };

    fn setup() -> WorldSetup {
        let law = SpringLaw { stiffness: 10.0, damping: 0.01 };
        let spring = Spring { particles: [0, 1], kind: SpringKind::Stretch, rest_length: 1.0, law };
        let network = Network {
            x: vec![[0.0; 3], [1.0, 0.0, 0.0]],
            v: vec![[0.0; 3]; 2],
            masses: vec![1.0; 2],
            pins: vec![0],
            springs: vec![spring],
            ..Network::default()
        };
        let settings = ClothSettings::default();
        let floor = Collider {
            name: "floor".to_owned(),
            shape: Plane { point: [0.0, -5.0, 0.0], normal: [0.0, 1.0, 0.0] }.into(),
            velocity: [0.0; 3],
            way: None,
            friction: 0.0,
            restitution: 0.0,
            margin: 0.0,
            contact: Contact::default(),
            recovery: Collider::RECOVERY,
            on_start_inside: StartInside::Warn,
        };
        WorldSetup {
            dt: 0.01,
            gravity: [0.0, -9.81, 0.0],
            wind: [0.0; 3],
            wind_at: Vec::new(),
            colliders: vec![floor],
            bodies: vec![BodySetup { name: "rope".to_owned(), network, settings, forces: Vec::new() }],
            snow: None,
        }
    }

    fn made(precision: Precision) -> Simulation {
        Simulation::new(&setup(), precision).expect("a good setup").0
    }

    /// A simulation on which calls have acted, after a step, and after a pin was sent again.
    fn stepped() -> Simulation {
        let mut simulation = made(Precision::F64);
        let pin = || Change::Pin { particle: 0, target: [0.1, 0.0, 0.0], duration: 1.0 };
        let keys = [MoveKey { time: 1.0, position: Some([0.0, -4.0, 0.0]), turn: None }].into();
        let force = Change::Force {
            body: "rope".to_owned(),
            particles: [1].into(),
            forces: Forces::One([0.0, 0.0, 1.0]),
        };
        let collider = Change::Collider(ColliderMove { collider: "floor".to_owned(), keys });
        simulation.apply(&[pin(), force, collider]).expect("good changes");
        simulation.step(&mut NoStopwatch).expect("it is stable");
        simulation.apply(&[pin()]).expect("a good change");
        simulation
    }

    fn state() -> State<f64> {
        match stepped().take() {
            WorldState(Precise::F64(state)) => state,
            WorldState(Precise::F32(_)) => panic!("it is in f64"),
        }
    }

    #[test]
    fn a_state_fits_a_simulation_of_its_setup_which_goes_on_with_its_hash() {
        let (before, mut fresh) = (stepped(), made(Precision::F64));
        let state = before.take();
        assert_eq!(state.check(&fresh), Ok(()));
        fresh.put(&state);
        assert_eq!((fresh.state_hash(), state.step_count()), (before.state_hash(), 1));
        let needed = Precision::F32;
        assert_eq!(state.check(&made(needed)), Err(StateError::Precision { needed }));
    }

    #[test]
    fn what_no_simulation_can_go_on_from_is_refused_by_name() {
        type Spoil = fn(&mut State<f64>);
        let spoiled: [(Spoil, &str); 23] = [
            (|s| s.step_count = u64::MAX, "steps were taken"),
            (|s| s.gravity[1] = f64::NAN, "gravity"),
            (|s| s.wind = Wind::new([f64::INFINITY; 3], &[]), "wind"),
            (|s| s.motions.clear(), "0 ways of colliders"),
            (|s| s.motions[0].velocity[0] = f64::NAN, "velocity"),
            (|s| s.motions[0].velocity[0] = 1.0, "a velocity and a way"),
            (|s| s.motions[0].way = Some(Way { keys: Vec::new() }), "no keys"),
            (|s| s.cloths.clear(), "0 cloths"),
            (|s| s.cloths[0].state.x.truncate(1), "positions"),
            (|s| s.cloths[0].state.v[1] = Padded([f64::NAN; 4]), "velocity of particle"),
            (|s| s.cloths[0].state.dv.resize(5, Sixteen::default()), "sixteens"),
            (|s| s.cloths[0].state.past.dt = f64::NAN, "sub-step before"),
            (|s| s.cloths[0].state.gain.energy = f64::NAN, "energy"),
            (|s| s.cloths[0].state.led_since = f64::NAN, "begun at NaN"),
            (|s| s.cloths[0].state.since_cap = u32::MAX, "solves"),
            (|s| s.cloths[0].state.motions[0].particle = u32::MAX, "4294967295"),
            (|s| s.cloths[0].state.motions[0].next = 7, "point 7"),
            (|s| s.cloths[0].state.motions[0].steps_left = f64::NAN, "NaN"),
            (|s| s.cloths[0].sent[0].points = Arc::default(), "its way has 0"),
            (|s| s.cloths[0].forces.push([0.0; 3]), "3 forces"),
            (|s| s.cloths[0].forces[1][0] = 1e300, "allowed are"),
            (|s| s.cloths[0].parameters.laws.clear(), "other laws"),
            (|s| s.cloths[0].parameters.drag = -1.0, "drag"),
        ];
        let simulation = made(Precision::F64);
        for (spoil, named) in spoiled {
            let mut state = state();
            spoil(&mut state);
            let refused = WorldState(Precise::F64(state)).check(&simulation).expect_err(named).to_string();
            assert!(refused.contains(named), "{named}: {refused}");
        }
    }

    #[test]
    fn a_pin_that_is_listed_twice_is_refused() {
        let mut state = state();
        let motions = &mut state.cloths[0].state.motions;
        let twice = motions[0].clone();
        motions.push(twice);
        let refused = WorldState(Precise::F64(state)).check(&made(Precision::F64)).expect_err("a pin twice");
        assert!(refused.to_string().contains("out of order or twice"), "{refused}");
    }
}
