//! Bounds on time steps, and which of them binds.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::names::names;

/// A bound on the time step of snow or cloth, by name: docs/laws/snow.md and docs/laws/steps.md derive each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum BoundKind {
    /// The elastic wave, hardening included, crosses a share of a cell per step.
    ElasticWave,
    /// A particle alone on its nodes is an oscillator: dt < 2 / omega.
    IsolatedParticle,
    /// A particle stays within half a cell.
    ParticleSpeed,
    /// I + dt grad v keeps its orientation.
    VelocityGradient,
    /// A collider moves by half a cell at most, or by half of its thickness where that is less.
    ColliderSpeed,
    /// The step that the scene fixes is below every bound.
    Fixed,
    /// What is left of the world's step is below every bound.
    Frame,
    /// Stiffness and damping of cloth at a particle: an explicit step keeps every motion from growing.
    Stiffness,
    /// Damping of cloth at a particle, without which no step of explicit Euler is stable.
    Damping,
    /// A longer implicit step of cloth was not accepted.
    Acceptance,
    /// The error estimate of cloth stays below the scene's tolerance.
    Tolerance,
    /// The ends of a spring of cloth move against each other by a quarter of its rest length at most in an explicit step.
    SpringSpeed,
    /// The medium slows cloth at a particle: the air more than halves an explicit step.
    Medium,
}

impl fmt::Display for BoundKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

names!(BoundKind {
    ElasticWave: "elastic_wave",
    IsolatedParticle: "isolated_particle",
    ParticleSpeed: "particle_speed",
    VelocityGradient: "velocity_gradient",
    ColliderSpeed: "collider_speed",
    Fixed: "fixed",
    Frame: "frame",
    Stiffness: "stiffness",
    Damping: "damping",
    Acceptance: "acceptance",
    Tolerance: "tolerance",
    SpringSpeed: "spring_speed",
    Medium: "medium",
});

/// The bound that binds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeBound {
    /// Which bound it is.
    pub kind: BoundKind,
    /// Largest dt (s) that it allows, safety included.
    pub dt: f64,
    /// The particle that sets it, over all particles of the world; none where no particle does.
    pub particle: Option<u64>,
}
