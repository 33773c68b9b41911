//! Changes between two steps, and why one is refused.

use serde::{Deserialize, Serialize};

use std::sync::Arc;

use thiserror::Error;

use super::collider_move::{ColliderMove, MoveError, there_are};
use crate::{
    cloth::SpringKind,
    math::number,
    world::setup::{
        forces::Forces,
        pulls::{Pull, PullError},
        vectors::Vectors,
    },
};

/// A change between two steps, its numbers within [`allowed`]. Particles are in the user's numbering, over all
/// bodies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Change {
    /// New gravity of the world (m/s²).
    Gravity([f64; 3]),
    /// New velocity of the medium (m/s).
    Wind([f64; 3]),
    /// New linear drag of the medium on every particle of cloth (N s/m).
    Drag(f64),
    /// The air around a cloth that feels it; `None` leaves a number as it is. Bodies with a thickness share theirs.
    Air {
        /// Name of the cloth; `None`: all that feel air.
        body: Option<String>,
        /// New density (kg/m³).
        density: Option<f64>,
        /// New coefficients, see [`Air`](crate::cloth::Air).
        normal: Option<f64>,
        #[allow(missing_docs, reason = "see above")]
        lift: Option<f64>,
        #[allow(missing_docs, reason = "see above")]
        tangential: Option<f64>,
    },
    /// Stiffness (N/m) and damping (N s/m) of springs; `None` leaves one as it is.
    Springs {
        /// Name of the cloth; `None`: all cloths.
        body: Option<String>,
        /// Kind of spring; `None`: all kinds.
        kind: Option<SpringKind>,
        /// New stiffness (N/m).
        stiffness: Option<f64>,
        /// New damping (N s/m).
        damping: Option<f64>,
    },
    /// Moves a pinned particle to `target` (m) within `duration` (s), at constant speed.
    Pin {
        /// Number of the particle over all bodies, from 0.
        particle: u32,
        /// Position at which it arrives (m).
        target: [f64; 3],
        /// Time that it takes (s), one step at least.
        duration: f64,
    },
    /// Moves a pinned particle along a path, at constant speed from point to point.
    PinPath {
        /// Number of the particle over all bodies, from 0.
        particle: u32,
        /// Times from the change on (s), above 0 and growing, each with the position (m) at which it is then. One step
        /// to the first at least.
        points: Arc<[(f64, [f64; 3])]>,
    },
    /// Moves a collider along a way, from where it is.
    Collider(ColliderMove),
    /// Sets forces on particles of a body, from now on until the next ones on the same particles. They add to those of the
    /// scene.
    Force {
        /// Name of a cloth or of an object of snow.
        body: String,
        /// Numbers of the particles within the body, from 0; all of them where there are none. Pins among all stay without.
        particles: Arc<[u32]>,
        /// The forces on them (N).
        forces: Forces,
    },
    /// Pulls at particles of a cloth, or no longer, in place of the pulls that there were on them.
    Pull(Pull),
    /// Puts all particles of a body elsewhere, and forgets what was before: pins stand where they are put, and snow is without
    /// deformation. A body is put once among changes that are applied together.
    State {
        /// Name of a cloth or of an object of snow.
        body: String,
        /// Positions (m), as many as the body has particles.
        positions: Vectors,
        /// Velocities (m/s), as many; none: all are 0. Those of pins are 0.
        velocities: Option<Vectors>,
    },
    /// Puts every body and parameter back to the start of the simulation, before all changes. Steps and time go on; frames of figures begin
    /// again.
    Reset,
}

/// Bytes of a list that count as a change.
const BYTES_PER_CHANGE: usize = 1024;

impl Change {
    /// What it counts for in bounds on changes: 1, or 1 for each point of a path or of a way, or for each KiB of forces, of pulls or of a state.
    pub fn weight(&self) -> usize {
        match self {
            Self::PinPath { points, .. } => points.len(),
            Self::Collider(asked) => asked.keys.len(),
            Self::Force { particles, forces, .. } => {
                1 + (size_of_val(&**particles) + size_of_val(forces.all())) / BYTES_PER_CHANGE
            }
            Self::Pull(Pull { particles, points, .. }) => {
                1 + (size_of_val(&**particles) + size_of_val(&**points)) / BYTES_PER_CHANGE
            }
            Self::State { positions, velocities, .. } => {
                let velocities = velocities.as_deref().unwrap_or_default();
                1 + (size_of_val(&**positions) + size_of_val(velocities)) / BYTES_PER_CHANGE
            }
            _ => 1,
        }
    }

    /// Memory that it takes while it waits (bytes), with its lists and names, but without what somebody else counts.
    pub fn bytes(&self) -> usize {
        let listed = match self {
            Self::PinPath { points, .. } => size_of_val(&**points),
            Self::Collider(asked) => asked.collider.len() + size_of_val(&*asked.keys),
            Self::Force { body, particles, forces } => {
                let each = if let Forces::Each(each) = forces { size_of_val(&**each) } else { 0 };
                body.len() + size_of_val(&**particles) + each
            }
            Self::Pull(Pull { body, particles, points, .. }) => {
                body.len() + size_of_val(&**particles) + size_of_val(&**points)
            }
            Self::State { body, positions, velocities } => {
                body.len() + positions.bytes() + velocities.as_ref().map_or(0, Vectors::bytes)
            }
            Self::Air { body, .. } | Self::Springs { body, .. } => body.as_ref().map_or(0, String::len),
            Self::Gravity(_) | Self::Wind(_) | Self::Drag(_) | Self::Pin { .. } | Self::Reset => 0,
        };
        size_of::<Self>() + listed
    }
}

/// Numbers that changes and scenes allow, both ends included.
pub mod allowed {
    /// Components of gravity (m/s²).
    pub const GRAVITY: [f64; 2] = [-1e4, 1e4];
    /// Components of a velocity (m/s).
    pub const SPEED: [f64; 2] = [-1e4, 1e4];
    /// Drag of a particle (N s/m).
    pub const DRAG: [f64; 2] = [0.0, 1e9];
    /// Stiffness of a spring (N/m).
    pub const STIFFNESS: [f64; 2] = [0.0, 1e12];
    /// Damping of a spring (N s/m).
    pub const DAMPING: [f64; 2] = [0.0, 1e9];
    /// Coordinates (m).
    pub const LENGTH: [f64; 2] = [-1e6, 1e6];
    /// Time that a pin or a collider takes (s).
    pub const DURATION: [f64; 2] = [0.0, 1e9];
    /// Components of a force (N).
    pub const FORCE: [f64; 2] = [-1e9, 1e9];
}

/// A change that was refused; nothing was changed.
#[derive(Clone, Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ChangeError {
    #[error("{field} is {}: allowed are {} to {}", number(*value), number(allowed[0]), number(allowed[1]))]
    OutOfRange { field: &'static str, value: f64, allowed: [f64; 2] },
    #[error("no body is named '{name}'; {}", there_are(known))]
    UnknownBody { name: String, known: String },
    #[error("{body}: {what} of {found} particles, and the body has {needed}")]
    WrongCount { body: String, what: &'static str, found: usize, needed: usize },
    #[error("states {first} and {second} put '{body}': one state of a body in a call is allowed")]
    StateTwice { body: String, first: usize, second: usize },
    #[error("{body}: {found} forces for {needed} particles: one for each, or one for all, is needed")]
    ForceCount { body: String, found: usize, needed: usize },
    #[error("{body}: {what} of particle {particle} is {}: allowed are {} to {}", number(*value), number(allowed[0]), number(allowed[1]))]
    StateRange { body: String, what: &'static str, particle: usize, value: f64, allowed: [f64; 2] },
    #[error(
        "{body}: particle {particle} is put at {} m: the grid of the snow reaches {} m from the origin along each axis, with a larger cell farther",
        number(*value),
        number(*reach)
    )]
    BeyondGrid { body: String, particle: usize, value: f64, reach: f64 },
    #[error("{body}: particle {particle} is pinned, and feels no force: a pin is moved")]
    ForceOnPin { body: String, particle: u32 },
    #[error("{body}: there is no particle {particle}: the body has {count}, from 0")]
    NotInBody { body: String, particle: u32, count: usize },
    #[error(
        "body '{}': {message}; leave a gap, and put bodies that make room for each other by one call",
        bodies[0]
    )]
    NotApart { bodies: [String; 2], particles: [u32; 2], message: String },
    #[error("'{body}' is snow that ranks step: forces, states and resets are for snow of one process")]
    SnowOverRanks { body: String },
    #[error("body '{body}' has no {kind} springs")]
    NoSuchSprings { body: String, kind: &'static str },
    #[error("'{name}' is snow, which has no springs")]
    SnowHasNoSprings { name: String },
    #[error("body '{body}' feels no air: give it [body.air] in its scene")]
    NoAir { body: String },
    #[error(
        "body '{body}' has a thickness and shares its air with {others}: change that of all bodies, which no name asks for"
    )]
    SharedAir { body: String, others: String },
    #[error("there is no air to change: no body has [body.air] in its scene")]
    NoneFeelsAir,
    #[error("there are no springs to change: there is no cloth")]
    NoCloth,
    #[error("particle {particle} is not pinned")]
    NotPinned { particle: u32 },
    #[error("there is no particle {particle}: there are {count}, from 0")]
    NoSuchParticle { particle: u32, count: usize },
    #[error(transparent)]
    Pull(#[from] PullError),
    #[error(transparent)]
    Collider(#[from] MoveError),
    #[error("'{figure}' is a figure, which its frames lead: {what}")]
    OnFigure { figure: String, what: &'static str },
    #[error("'{object}' is attached to collider '{collider}': calls move neither")]
    Attached { object: String, collider: String },
    #[error("the path of particle {particle} has no points: one or more are needed")]
    EmptyPath { particle: u32 },
    #[error(
        "point {point} of the path of particle {particle} is at {} s: a time after {} s is needed",
        number(*time),
        number(*after)
    )]
    TimesOfPath { particle: u32, point: usize, time: f64, after: f64 },
}
