//! What further steps of a world depend on: taken from one simulation, put into another of its setup.

use serde::{Deserialize, Serialize};

use super::{clock::World, cloth::Taken, pace::Pace, simulation::Simulation, wind::Wind};
use crate::{
    collide::{Collider, Motion},
    field::Field,
    math::{Real, bytes},
    snow::{Snow, TakenSnow},
};

/// What further steps depend on. Of a simulation that several ranks step, that of rank 0 is whole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WorldState(Precise);

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
            Self::F32(world) => world.step_count += 1,
            Self::F64(world) => world.step_count += 1,
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
    /// If the setup or the precision was another one.
    pub fn put(&mut self, state: &WorldState) {
        match (self, &state.0) {
            (Self::F32(world), Precise::F32(state)) => world.put(state),
            (Self::F64(world), Precise::F64(state)) => world.put(state),
            _ => panic!("the state of a simulation in another precision"),
        }
    }
}
