//! What surrounds one step of the snow.

use crate::{collide::Collider, interrupt::Interrupt};

/// What surrounds one step of the snow; a step of the world holds one or more of them.
#[derive(Clone, Copy)]
pub(crate) struct StepContext<'a> {
    /// Time step (s).
    pub(crate) dt: f64,
    /// Time at the end of the step (s).
    pub(crate) time: f64,
    /// Gravity (m/s²).
    pub(crate) gravity: [f64; 3],
    /// What nodes and particles hit.
    pub(crate) colliders: &'a [Collider],
    /// Looked at by solvers.
    pub(crate) interrupt: &'a Interrupt,
}
