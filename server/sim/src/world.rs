//! The world: gravity, wind, colliders and bodies on one clock.
//!
//! Reads a [`WorldSetup`] (binary64, the user's numbering); writes positions, reports, or the
//! reason why a step was not taken.

use thiserror::Error;

use crate::{
    cloth::{ClothSettings, Network, SpringKind},
    collide::Collider,
    math::Precision,
    report::{Diagnostics, StepError, StepReport, Stopwatch},
};

/// A body of a world.
#[derive(Clone, Debug, PartialEq)]
pub struct BodySetup {
    /// Name, unique in the world.
    pub name: String,
    /// Particles and springs.
    pub network: Network,
    /// How it is stepped.
    pub settings: ClothSettings,
}

/// Everything that a simulation starts from.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldSetup {
    /// Time step (s).
    pub dt: f64,
    /// Gravity (m/s²).
    pub gravity: [f64; 3],
    /// Velocity of the medium (m/s).
    pub wind: [f64; 3],
    /// Colliders.
    pub colliders: Vec<Collider>,
    /// Bodies, at least one.
    pub bodies: Vec<BodySetup>,
}

/// A world that cannot be built.
#[derive(Clone, Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum SetupError {
    #[error("the world has no bodies")]
    NoBodies,
    #[error("dt is {0}: a time step is a finite number of seconds above 0")]
    BadTimeStep(f64),
    #[error("{what} is not finite: {value:?}")]
    NotFinite { what: String, value: [f64; 3] },
    #[error("body '{body}': {message}")]
    Body { body: String, message: String },
    #[error("collider '{collider}': {message}")]
    Collider { collider: String, message: String },
}

/// A change between two steps. Particles are in the user's numbering, over all bodies.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// Gravity (m/s²).
    Gravity([f64; 3]),
    /// Velocity of the medium (m/s).
    Wind([f64; 3]),
    /// Linear drag of the medium on every particle (N s/m).
    Drag(f64),
    /// Stiffness (N/m) and damping (N s/m) of springs; `None` leaves one as it is.
    Springs {
        /// Body; `None`: all.
        body: Option<String>,
        /// Kind; `None`: all.
        kind: Option<SpringKind>,
        /// New stiffness (N/m).
        stiffness: Option<f64>,
        /// New damping (N s/m).
        damping: Option<f64>,
    },
    /// Moves a pinned particle to `target` (m) within `duration` (s), at constant speed.
    Pin {
        /// Particle.
        particle: u32,
        /// Target (m).
        target: [f64; 3],
        /// Duration (s), rounded up to one step.
        duration: f64,
    },
}

/// A change that was refused; nothing was changed.
#[derive(Clone, Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ChangeError {
    #[error("{field} is {value}: {allowed}")]
    OutOfRange { field: &'static str, value: f64, allowed: &'static str },
    #[error("no body is named '{name}'; there are: {known}")]
    UnknownBody { name: String, known: String },
    #[error("body '{body}' has no {kind} springs")]
    NoSuchSprings { body: String, kind: &'static str },
    #[error("particle {particle} is not pinned")]
    NotPinned { particle: u32 },
    #[error("there is no particle {particle}: there are {count}, from 0")]
    NoSuchParticle { particle: u32, count: usize },
}

/// What a frame's consumer needs to know once about a body.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyTopology {
    /// Name.
    pub name: String,
    /// Index of its first particle among all.
    pub first_particle: u32,
    /// Number of particles.
    pub particle_count: u32,
    /// Triangles, indices over all particles.
    pub triangles: Vec<[u32; 3]>,
    /// Springs, indices over all particles.
    pub springs: Vec<[u32; 2]>,
    /// Pinned particles, indices over all particles.
    pub pins: Vec<u32>,
    /// Texture coordinates, or empty.
    pub uv: Vec<[f64; 2]>,
}

/// Largest explicit time step of a body, from a bound that holds for any mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct StepBound {
    /// Body.
    pub body: String,
    /// Largest stable dt (s) of the symplectic integrators for small motions about rest, a lower
    /// bound: sqrt(2 min m_i / lambda_max(D_i)), D_i = sum_j k_ij u u^T. Infinite without springs.
    pub dt: f64,
    /// The particle that sets it, over all bodies.
    pub particle: u64,
}

/// A simulation in the precision chosen at run time.
#[derive(Debug)]
pub enum Simulation {}

#[allow(unused_variables, clippy::missing_errors_doc, reason = "skeleton")]
impl Simulation {
    /// Builds a simulation; the strings are remarks that do not stop it.
    pub fn new(setup: &WorldSetup, precision: Precision) -> Result<(Self, Vec<String>), SetupError> {
        unimplemented!()
    }
    /// Precision of the state.
    pub fn precision(&self) -> Precision {
        unimplemented!()
    }
    /// Time step (s).
    pub fn dt(&self) -> f64 {
        unimplemented!()
    }
    /// Steps taken.
    pub fn step_count(&self) -> u64 {
        unimplemented!()
    }
    /// Simulated time (s).
    pub fn time(&self) -> f64 {
        unimplemented!()
    }
    /// Particles of all bodies.
    pub fn particle_count(&self) -> usize {
        unimplemented!()
    }
    /// Springs of all bodies.
    pub fn spring_count(&self) -> usize {
        unimplemented!()
    }
    /// Takes one step, on the rayon pool that the caller installed.
    pub fn step(&mut self, watch: &mut impl Stopwatch) -> Result<StepReport, StepError> {
        unimplemented!()
    }
    /// Figures of the state as it is.
    pub fn diagnose(&self) -> Diagnostics {
        unimplemented!()
    }
    /// Applies changes, all or none.
    pub fn apply(&mut self, changes: &[Change]) -> Result<(), ChangeError> {
        unimplemented!()
    }
    /// Checks changes without applying them.
    pub fn check(&self, changes: &[Change]) -> Result<(), ChangeError> {
        unimplemented!()
    }
    /// Positions (m), x y z a particle, user's numbering. Clears `out` first.
    pub fn positions_f32(&self, out: &mut Vec<f32>) {
        unimplemented!()
    }
    /// Positions (m), exact.
    pub fn positions_f64(&self, out: &mut Vec<f64>) {
        unimplemented!()
    }
    /// Velocities (m/s).
    pub fn velocities_f32(&self, out: &mut Vec<f32>) {
        unimplemented!()
    }
    /// Velocities (m/s), exact.
    pub fn velocities_f64(&self, out: &mut Vec<f64>) {
        unimplemented!()
    }
    /// Hash of the exact state: step, positions and velocities in the user's numbering.
    pub fn state_hash(&self) -> u64 {
        unimplemented!()
    }
    /// What frames refer to.
    pub fn topology(&self) -> Vec<BodyTopology> {
        unimplemented!()
    }
    /// Colliders.
    pub fn colliders(&self) -> &[Collider] {
        unimplemented!()
    }
    /// Largest explicit steps, a body each.
    pub fn step_bounds(&self) -> Vec<StepBound> {
        unimplemented!()
    }
}
