//! What further steps of cloths depend on beside the setup, the steps taken, positions and velocities: for a saved frame.
//!
//! Enters: a world between two steps. Leaves: numbers, and what no number says; or a world that goes on from such numbers.

use thiserror::Error;

use super::{World, pace::Pace};
use crate::{
    cloth::{Gain, PinMotion},
    collide::{Collider, Motion},
    math::Real,
    names::names,
    world::body::{Body, cloth::Cloth},
};

/// Pins of a cloth that are told one by one, at most.
const MOST_PINS: usize = 1024;

/// What further steps depend on that neither the setup says nor steps, positions and velocities. Of snow it is not told.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Carried {
    /// Numbers in an order of this version: of the pace of sub-steps first, then of each cloth.
    pub numbers: Vec<f64>,
    /// What steps depend on, too, and no number says.
    pub missing: Vec<Missing>,
}

/// What further steps depend on and no number of a saved frame says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// Gravity, wind, parameters, forces, pulls, or ways of colliders that calls have changed.
    Calls,
    /// The sub-step before, of integrators that know of it.
    Past,
    /// The change of velocity of the step before, where solves begin from it.
    WarmStart,
    /// What patches are set up for, and how long solves have used them.
    Patches,
    /// How far each pin is within a sub-step, where too many are.
    Pins,
    /// How still cloth lies, and what of it sleeps, where it may.
    Rest,
}

names!(Missing {
    Calls: "calls",
    Past: "past",
    WarmStart: "warm_start",
    Patches: "patches",
    Pins: "pins",
    Rest: "rest",
});

/// Numbers of a [`Carried`] that a world cannot go on from.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum CarriedError {
    #[error("the numbers are none that this version tells of such a scene")]
    Numbers,
    #[error("pins of {bodies} were on ways that the scene does not have: a call had sent them")]
    Pins { bodies: String },
}

impl<R: Real> World<R> {
    pub(crate) fn carried(&self) -> Carried {
        let cloths = || self.bodies.iter().filter_map(Body::as_cloth);
        let mut numbers = self.pace.all_numbers().to_vec();
        for cloth in cloths() {
            cloth.tell(&mut numbers);
        }
        let is_missing = |what: &Missing| match what {
            Missing::Calls => self.is_changed() || cloths().any(Cloth::is_changed),
            Missing::Past => cloths().any(|cloth| cloth.state.past.dt > 0.0),
            Missing::WarmStart => cloths().any(|cloth| cloth.starts_warm() && !cloth.state.dv.is_empty()),
            Missing::Patches => cloths().any(Cloth::uses_patches),
            Missing::Pins => cloths().any(|cloth| cloth.pins_within().count() > MOST_PINS),
            Missing::Rest => cloths().any(|cloth| cloth.settings.rest.is_some_and(|rest| rest.sleep)),
        };
        Carried { numbers, missing: Missing::ALL.into_iter().filter(is_missing).collect() }
    }

    /// Whether gravity, wind or the way of a collider is another one than at the start.
    fn is_changed(&self) -> bool {
        let (gravity, wind, motions) = &self.start;
        let is_moved = |(collider, motion): (&Collider, &Motion)| {
            collider.velocity != motion.velocity || collider.way != motion.way
        };
        self.gravity != *gravity || self.wind != *wind || self.colliders.iter().zip(motions).any(is_moved)
    }

    /// Goes on from numbers that a world of this setup told when its bodies were where they are now.
    ///
    /// # Errors
    /// When they are no such numbers; the world is not to be stepped then.
    pub(crate) fn take_over(&mut self, numbers: &[f64]) -> Result<(), CarriedError> {
        let mut numbers = numbers.iter().copied();
        self.pace = Pace::of_numbers(next(&mut numbers)?).ok_or(CarriedError::Numbers)?;
        for cloth in self.bodies.iter_mut().filter_map(Body::as_cloth_mut) {
            cloth.take_over(&mut numbers)?;
        }
        if numbers.next().is_some() { Err(CarriedError::Numbers) } else { Ok(()) }
    }
}

impl<R: Real> Cloth<R> {
    /// Whether calls have changed its parameters or act on it by forces or pulls.
    fn is_changed(&self) -> bool {
        self.parameters != self.start.1 || !self.acting.called().is_empty() || !self.pulls.is_empty()
    }

    /// Whether solves use patches, or begin with those that a solve before left.
    fn uses_patches(&self) -> bool {
        self.state.since_cap > 0 || !self.state.kept.positions().is_empty()
    }

    /// Adds its numbers: what it gained, when frames of its figures began if it has any, which pins are on which ways, and how far those
    /// are that stand within a sub-step.
    fn tell(&self, numbers: &mut Vec<f64>) {
        let Gain { energy, kept, ratio, motion } = self.state.gain;
        numbers.extend([energy, kept, ratio, motion]);
        if !self.model.figures.is_empty() {
            numbers.push(self.state.led_since);
        }
        numbers.extend(halves(self.hash_pins()));
        let within: Vec<[f64; 2]> = self.pins_within().take(MOST_PINS).collect();
        numbers.push(within.len() as f64);
        numbers.extend(within.as_flattened());
    }

    /// Places, among the pins on their way, of those that have no whole number of sub-steps left, and what they have left:
    /// parts of a step add up to it but for rounding.
    fn pins_within(&self) -> impl Iterator<Item = [f64; 2]> {
        let is_within = |(_, motion): &(usize, &PinMotion)| motion.steps_left.fract() != 0.0;
        let placed = self.state.motions.iter().enumerate().filter(is_within);
        placed.map(|(place, motion)| [place as f64, motion.steps_left])
    }

    fn take_over(&mut self, numbers: &mut impl Iterator<Item = f64>) -> Result<(), CarriedError> {
        let [energy, kept, ratio, motion] = next(numbers)?;
        self.state.gain = Gain { energy, kept, ratio, motion };
        if !self.model.figures.is_empty() {
            [self.state.led_since] = next(numbers)?;
        }
        let [high, low, count] = next(numbers)?;
        if !(0.0..=MOST_PINS as f64).contains(&count) {
            return Err(CarriedError::Numbers);
        }
        let other_ways = || CarriedError::Pins { bodies: self.parts.names().to_owned() };
        for _ in 0..count as usize {
            let [place, left] = next(numbers)?;
            let motion = self.state.motions.get_mut(place as usize).ok_or_else(other_ways)?;
            motion.steps_left = left;
        }
        if halves(self.hash_pins()) == [high, low] { Ok(()) } else { Err(other_ways()) }
    }
}

/// A hash as two numbers, each of which holds half of it exactly.
fn halves(hash: u64) -> [f64; 2] {
    [hash >> 32, hash & u64::from(u32::MAX)].map(|half| half as f64)
}

/// The next of the numbers, all finite.
fn next<const N: usize>(numbers: &mut impl Iterator<Item = f64>) -> Result<[f64; N], CarriedError> {
    let mut taken = [0.0; N];
    for number in &mut taken {
        *number = numbers.next().filter(|number| number.is_finite()).ok_or(CarriedError::Numbers)?;
    }
    Ok(taken)
}
