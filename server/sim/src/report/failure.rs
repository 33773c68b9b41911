//! Why a step was not taken.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use thiserror::Error;

use super::bound::BoundKind;
use crate::linalg::Outcome;

/// A step that was not taken: cloths are as before it, snow as after its last good step within it.
#[derive(Clone, Debug, PartialEq, Error, Serialize, Deserialize)]
#[error("step {step} at t = {time:.6} s, body '{body}': {failure}")]
pub struct StepError {
    /// Index of the step, from 0.
    pub step: u64,
    /// Simulated time before it (s).
    pub time: f64,
    /// Name of the cloth, or of the object of snow.
    pub body: String,
    /// Why it was not taken.
    pub failure: StepFailure,
}

/// Why a step was not taken. Particles are in the user's numbering, over all bodies.
#[derive(Clone, Debug, PartialEq, Error, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum StepFailure {
    #[error(
        "the {quantity} of particle {particle} became {value}: the simulation diverged (reduce dt or the stiffness)"
    )]
    NotFinite { particle: u64, quantity: Cow<'static, str>, value: f64 },
    #[error(
        "no step can be taken: the spring from particle {particle} to {other} is {value:.4e} m long, of {rest_length:.4e} m at rest, and its direction is lost to rounding (move its ends apart)"
    )]
    Collapsed { particle: u64, other: u64, value: f64, rest_length: f64 },
    #[error(
        "the cloth from particle {particle} to {other} is {value:.4} times its rest length, more than the limit of {limit}{}",
        of_pulled(*pin)
    )]
    Stretch { particle: u64, other: u64, value: f64, limit: f64, pin: Option<u64> },
    #[error(
        "kinetic and elastic energy came to {value:.6e} J, more than the limit of {limit} J (fastest particle: {particle})"
    )]
    Energy { particle: u64, value: f64, limit: f64 },
    #[error("the linear solver cannot go on: {outcome}")]
    Solver { outcome: Outcome },
    #[error(
        "the potential of the step falls by {value:.4e} J where its linear solve predicts a fall of {predicted:.4e} J, of which {limit} is needed: the forces change too much within the step (energy rises most at particle {particle})"
    )]
    Descent { particle: u64, value: f64, predicted: f64, limit: f64 },
    #[error(
        "the total energy rises by {value:.4e} J, more than the {limit:.4e} J that pins, the medium, contacts and the error of the method account for (most at particle {particle})"
    )]
    EnergyGain { particle: u64, value: f64, limit: f64 },
    #[error(
        "after {sweeps} sweeps the momentum of what particle {particle} belongs to does not balance: {value:.4e} N s are left over, more than {limit:.4e}"
    )]
    Unbalanced { particle: u64, value: f64, limit: f64, sweeps: u32 },
    #[error(
        "after {solves} linear solves the fall of the step's potential differs by {value:.4e} J from what the last one predicts, more than the {limit:.4e} J that the accuracy allows: the forces change too much within the step (energy rises most at particle {particle})"
    )]
    Missed { particle: u64, value: f64, limit: f64, solves: u32 },
    #[error(
        "the position of particle {particle} has an estimated error of {value:.4e} m in the step, more than the tolerance of {limit:.4e} m"
    )]
    Inaccurate { particle: u64, value: f64, limit: f64 },
    #[error("particle {particle} goes through collider '{collider}', or into it, within the step")]
    Passed { particle: u64, collider: String },
    #[error(
        "the surfaces at particles {} and {} cannot be kept apart within the step: they come to {gap:.4e} m (leave them more room, move pins and colliders more slowly, or reduce dt){}",
        .particles[0],
        .particles[1],
        of_driven(*driven)
    )]
    Contact { particles: [u64; 2], gap: f64, driven: Option<u64> },
    #[error(
        "too much cloth comes together at particle {particle} to be kept apart within the step: there are more than {limit} pairs of a corner and a triangle, or of two edges, that may meet at the 64 triangles there (leave surfaces more room, move them more slowly, reduce dt or the thickness, or make the mesh coarser)"
    )]
    Crowded { particle: u64, limit: u64 },
    #[error(
        "the pairs of surfaces that may meet within the step need {bytes} bytes, more than may be taken for them"
    )]
    PairMemory { bytes: u64 },
    #[error(
        "no step is stable: explicit Euler gains energy in every motion that is not damped, as at particle {particle} (choose symplectic_euler, add drag, or mark the step unchecked)"
    )]
    NeverStable { particle: u64 },
    #[error(
        "the time step of {dt:.4e} s is above the bound '{bound}' of {limit:.4e} s at particle {particle}: let the step be certified, fix a smaller one, or mark it unchecked"
    )]
    TimeStep { particle: u64, dt: f64, limit: f64, bound: BoundKind },
    #[error(
        "more than {limit} sub-steps are needed within this step of the scene: the bound '{bound}' at particle {particle}{} allows {dt:.4e} s (shorten the scene's dt, or look at what happens there)",
        of_law(law.as_deref())
    )]
    Substeps { particle: u64, dt: f64, limit: u32, bound: BoundKind, law: Option<String> },
    #[error(
        "node {node:?} of the grid moves by {value:.3} cells in one step, more than {limit}: the simulation diverged (fastest particle: {particle})"
    )]
    NodeSpeed { particle: u64, node: [i32; 3], value: f64, limit: f64 },
    #[error(
        "the deformation gradient of particle {particle} came to {value:.4e}, more than {limit:.0e}: the simulation diverged"
    )]
    Deformation { particle: u64, value: f64, limit: f64 },
    #[error(
        "particle {particle} left the range of the grid, {limit:.3e} m from the origin: it is at {position:?}"
    )]
    OutOfRange { particle: u64, position: [f64; 3], limit: f64 },
    #[error(
        "the grid would take {bytes} bytes, more than {limit}: the snow flies apart (farthest out is particle {particle}, at {position:?})"
    )]
    GridMemory { particle: u64, position: [f64; 3], bytes: u64, limit: u64 },
    #[error("the grid holds {found:.9e} kg of the particles' {expected:.9e} kg")]
    Mass { expected: f64, found: f64 },
    #[error("the step was given up because the caller asked for it")]
    Interrupted,
}

/// What is said of an end of a spring that is pinned, and was moved within the step.
fn of_pulled(pin: Option<u64>) -> String {
    pin.map_or_else(String::new, |pin| {
        format!(": it hangs on particle {pin}, a pin that was moved within the step (give the pin more time)")
    })
}

/// What is said of the law that has the largest part in a bound.
fn of_law(law: Option<&str>) -> String {
    law.map_or_else(String::new, |law| format!(", most of it by {law},"))
}

/// What is said of a pin that moves where surfaces come together, or of a corner of a figure.
fn of_driven(driven: Option<u64>) -> String {
    driven.map_or_else(String::new, |pin| {
        format!("; particle {pin} there is a pin that is moved, or the corner of a figure: surfaces do not stop it, so let it go more slowly or less far")
    })
}

impl StepFailure {
    /// The same with particles numbered over all bodies: `of_all` gives the number of one of the body's own.
    pub(crate) fn renumbered(mut self, of_all: impl Fn(u64) -> u64) -> Self {
        if let Self::Stretch { other, .. } | Self::Collapsed { other, .. } = &mut self {
            *other = of_all(*other);
        }
        if let Self::Stretch { pin: Some(pin), .. } = &mut self {
            *pin = of_all(*pin);
        }
        if let Self::Contact { particles: [_, other], driven, .. } = &mut self {
            *other = of_all(*other);
            *driven = driven.map(&of_all);
        }
        if let Some(particle) = self.particle_mut() {
            *particle = of_all(*particle);
        }
        self
    }

    /// The particle at fault.
    pub fn particle(&self) -> Option<u64> {
        self.clone().particle_mut().copied()
    }

    fn particle_mut(&mut self) -> Option<&mut u64> {
        match self {
            Self::NotFinite { particle, .. }
            | Self::Collapsed { particle, .. }
            | Self::Stretch { particle, .. }
            | Self::Energy { particle, .. }
            | Self::Descent { particle, .. }
            | Self::EnergyGain { particle, .. }
            | Self::Unbalanced { particle, .. }
            | Self::Missed { particle, .. }
            | Self::Inaccurate { particle, .. }
            | Self::Passed { particle, .. }
            | Self::Contact { particles: [particle, _], .. }
            | Self::Crowded { particle, .. }
            | Self::NeverStable { particle }
            | Self::TimeStep { particle, .. }
            | Self::Substeps { particle, .. }
            | Self::NodeSpeed { particle, .. }
            | Self::Deformation { particle, .. }
            | Self::OutOfRange { particle, .. }
            | Self::GridMemory { particle, .. } => Some(particle),
            Self::Solver { .. } | Self::PairMemory { .. } | Self::Mass { .. } | Self::Interrupted => None,
        }
    }

    /// A stable word for programs, such as `NOT_FINITE`.
    pub const fn reason(&self) -> &'static str {
        match self {
            Self::NotFinite { .. } | Self::Collapsed { .. } => "NOT_FINITE",
            Self::Stretch { .. } => "STRETCH_LIMIT",
            Self::Energy { .. } => "ENERGY_LIMIT",
            Self::Solver { .. } => "SOLVER_FAILED",
            Self::Descent { .. } => "POTENTIAL_DESCENT",
            Self::EnergyGain { .. } => "ENERGY_GAIN",
            Self::Unbalanced { .. } => "MOMENTUM_BALANCE",
            Self::Missed { .. } => "STEP_ACCURACY",
            Self::Inaccurate { .. } => "ERROR_TOLERANCE",
            Self::Passed { .. } => "COLLIDER_PASSED",
            Self::Contact { .. } | Self::Crowded { .. } => "CONTACT",
            Self::PairMemory { .. } => "SERVER_MEMORY_FULL",
            Self::NeverStable { .. } => "NEVER_STABLE",
            Self::TimeStep { .. } => "TIME_STEP_LIMIT",
            Self::Substeps { .. } => "SUBSTEP_LIMIT",
            Self::NodeSpeed { .. } => "NODE_SPEED",
            Self::Deformation { .. } => "DEFORMATION_LIMIT",
            Self::OutOfRange { .. } => "OUT_OF_RANGE",
            Self::GridMemory { .. } => "GRID_MEMORY",
            Self::Mass { .. } => "MASS_LOST",
            Self::Interrupted => "STEPS_INTERRUPTED",
        }
    }

    /// The value at fault.
    pub const fn value(&self) -> Option<f64> {
        match self {
            Self::NotFinite { value, .. }
            | Self::Collapsed { value, .. }
            | Self::Stretch { value, .. }
            | Self::Energy { value, .. }
            | Self::Descent { value, .. }
            | Self::EnergyGain { value, .. }
            | Self::Unbalanced { value, .. }
            | Self::Missed { value, .. }
            | Self::Inaccurate { value, .. }
            | Self::NodeSpeed { value, .. }
            | Self::Deformation { value, .. }
            | Self::Contact { gap: value, .. }
            | Self::Mass { found: value, .. } => Some(*value),
            Self::GridMemory { bytes, .. } | Self::PairMemory { bytes } => Some(*bytes as f64),
            Self::TimeStep { dt, .. } | Self::Substeps { dt, .. } => Some(*dt),
            Self::Solver { .. }
            | Self::Passed { .. }
            | Self::Crowded { .. }
            | Self::NeverStable { .. }
            | Self::OutOfRange { .. }
            | Self::Interrupted => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pin_that_is_moved_is_named_by_its_number_over_all_bodies() {
        let closed = |driven| StepFailure::Contact { particles: [1, 2], gap: 1e-9, driven };
        let told = closed(Some(3)).renumbered(|own| own + 100).to_string();
        assert!(told.contains("at particles 101 and 102 cannot be kept apart"), "{told}");
        assert!(
            told.contains("; particle 103 there is a pin that is moved, or the corner of a figure"),
            "{told}"
        );
        assert!(!closed(None).to_string().contains("is moved"), "{}", closed(None));
    }
}
