//! What surrounds a body during one step of the world, the same for every kind of body.

use crate::{collide::Collider, interrupt::Interrupt, sub_step::SubStep};

/// Gravity, medium, colliders and clock of one step of the world.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// Gravity of all bodies (m/s²).
    pub gravity: [f64; 3],
    /// Velocity of the medium (m/s).
    pub wind: [f64; 3],
    /// What particles hit.
    pub colliders: &'a [Collider],
    /// Time at the start of the step (s).
    pub time: f64,
    /// The world's time step (s); each body divides it into steps of its own.
    pub dt: f64,
    /// How many of the steps that a scene asks for one of a body is long: more than 1 where a cloth sleeps. Contacts stay as stiff as in
    /// one step.
    pub steps: f64,
    /// Looked at within the step, which fails once it is requested.
    pub interrupt: &'a Interrupt,
}

impl Surroundings<'_> {
    /// The step of the world as one sub-step.
    pub(crate) fn whole(&self) -> SubStep {
        SubStep { dt: self.dt, end: self.time + self.dt }
    }
}
