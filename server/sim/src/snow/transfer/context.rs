//! What surrounds one step of the snow.

use crate::{collide::Collider, interrupt::Interrupt, sub_step::SubStep};

/// What surrounds one step of the snow; a step of the world holds one or more of them.
#[derive(Clone, Copy)]
pub(crate) struct StepContext<'a> {
    /// How long the step is, and when it ends.
    pub(crate) sub_step: SubStep,
    /// Gravity (m/s²).
    pub(crate) gravity: [f64; 3],
    /// Velocity of the medium (m/s).
    pub(crate) wind: [f64; 3],
    /// What nodes and particles hit.
    pub(crate) colliders: &'a [Collider],
    /// Looked at by solvers.
    pub(crate) interrupt: &'a Interrupt,
}
