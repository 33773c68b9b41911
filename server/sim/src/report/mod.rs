//! What a step tells: diagnostics, time per stage, or the reason why it failed.

mod snow;

pub use snow::{BoundKind, SnowReport, TimeBound};

use thiserror::Error;

use crate::linalg::{Outcome, SolveReport, Stop};

/// A stage of a step (Zara 2001, section 6, and those of snow).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Stage {
    /// Evaluation of a state of cloth: forces of springs, gravity and the medium, for an implicit step its matrix too;
    /// with energies, momentum and stretch.
    Force,
    /// Forces to accelerations: within `Force`, and so 0. It stands here, as do `Velocity` and `Matrix`, for those who
    /// read the table by its names.
    Acceleration,
    /// Accelerations to new velocities: within `Position`, and so 0.
    Velocity,
    /// New velocities and positions of cloth.
    Position,
    /// Preparing the matrix: within `Force`, and so 0.
    Matrix,
    /// Solving for the change of velocity.
    Solve,
    /// Particles of cloth that touch colliders.
    Collide,
    /// Snow: particles sorted by block and cell.
    Sort,
    /// Snow: weights, masses and momenta from particles to nodes, forces included.
    ParticlesToGrid,
    /// Snow: nodes' velocities, gravity and colliders.
    GridUpdate,
    /// Snow: velocities back to particles, elastic predictor, plastic return, positions.
    GridToParticles,
    /// Snow: energies, momentum and the checks on them.
    Diagnose,
}

impl Stage {
    /// Every stage, in the order of a table.
    pub const ALL: [Self; 12] = [
        Self::Force,
        Self::Acceleration,
        Self::Velocity,
        Self::Position,
        Self::Matrix,
        Self::Solve,
        Self::Collide,
        Self::Sort,
        Self::ParticlesToGrid,
        Self::GridUpdate,
        Self::GridToParticles,
        Self::Diagnose,
    ];

    /// Its name in tables and on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Force => "force",
            Self::Acceleration => "acceleration",
            Self::Velocity => "velocity",
            Self::Position => "position",
            Self::Matrix => "matrix",
            Self::Solve => "solve",
            Self::Collide => "collide",
            Self::Sort => "sort",
            Self::ParticlesToGrid => "particles_to_grid",
            Self::GridUpdate => "grid_update",
            Self::GridToParticles => "grid_to_particles",
            Self::Diagnose => "diagnose",
        }
    }
}

/// A clock that the caller brings: the library reads none.
pub trait Stopwatch {
    /// The time since the last call belongs to `stage`.
    fn lap(&mut self, stage: Stage);
}

/// The stopwatch of those who measure nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoStopwatch;

impl Stopwatch for NoStopwatch {
    fn lap(&mut self, _: Stage) {}
}

/// Diagnostics of a state.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Diagnostics {
    /// Kinetic energy of the free particles (J).
    pub kinetic_energy: f64,
    /// Elastic energy (J).
    pub elastic_energy: f64,
    /// Gravitational energy of the free particles (J), zero at the origin.
    pub gravitational_energy: f64,
    /// Linear momentum of the free particles (kg m/s).
    pub momentum: [f64; 3],
    /// Largest length over rest length of any spring; 0 without springs.
    pub max_stretch: f64,
}

impl Diagnostics {
    /// These diagnostics and those of another body together.
    pub(crate) fn with(&self, other: &Self) -> Self {
        Self {
            kinetic_energy: self.kinetic_energy + other.kinetic_energy,
            elastic_energy: self.elastic_energy + other.elastic_energy,
            gravitational_energy: self.gravitational_energy + other.gravitational_energy,
            momentum: std::array::from_fn(|c| self.momentum[c] + other.momentum[c]),
            max_stretch: self.max_stretch.max(other.max_stretch),
        }
    }

    /// Kinetic, elastic and gravitational energy together (J).
    pub fn total_energy(&self) -> f64 {
        self.kinetic_energy + self.elastic_energy + self.gravitational_energy
    }
}

/// What a step reports.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct StepReport {
    /// Steps taken, this one included.
    pub step: u64,
    /// Simulated time (s).
    pub time: f64,
    /// Diagnostics of the new state, all bodies together.
    pub diagnostics: Diagnostics,
    /// Particles that touched a collider, each once per sub-step in which it did.
    pub contact_count: u64,
    /// The linear solve with the largest residual among all bodies and their sub-steps, with the iterations that its
    /// body made in the step; none when all are explicit.
    pub solve: Option<SolveReport>,
    /// Diagnostics of the snow; none without snow.
    pub snow: Option<SnowReport>,
    /// What the user should know although the step was taken.
    pub notices: Notices,
}

/// What happened in a step that was taken, and makes its result doubtful. Particles are in the user's numbering, over
/// all bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Notices {
    /// Solves of cloth that ended at their iteration cap, above their tolerance.
    pub capped_solves: u32,
    /// Solves of cloth that met a curvature or a preconditioner that is not positive.
    pub indefinite_solves: u32,
    /// Particles of cloth that went through a collider, each once per sub-step in which it did.
    pub passed_count: u64,
    /// The first of them.
    pub first_passed: Option<u64>,
}

impl Notices {
    /// These of one body or sub-step and those of another together.
    #[must_use]
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            capped_solves: self.capped_solves + other.capped_solves,
            indefinite_solves: self.indefinite_solves + other.indefinite_solves,
            passed_count: self.passed_count + other.passed_count,
            first_passed: self.first_passed.into_iter().chain(other.first_passed).min(),
        }
    }

    /// Counts how a solve ended that was to stop so.
    pub(crate) fn count(&mut self, outcome: Outcome, stop: Stop) {
        match (outcome, stop) {
            (Outcome::IterationCap, Stop::Residual { .. }) => self.capped_solves += 1,
            (
                Outcome::NegativeCurvature { .. }
                | Outcome::ZeroCurvature { .. }
                | Outcome::IndefinitePreconditioner { .. },
                _,
            ) => self.indefinite_solves += 1,
            _ => {}
        }
    }
}

/// A step that was not taken: cloths are as before it, snow as after its last good step within it.
#[derive(Clone, Debug, PartialEq, Error)]
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
#[derive(Clone, Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum StepFailure {
    #[error(
        "the {quantity} of particle {particle} became {value}: the simulation diverged (reduce dt or the stiffness)"
    )]
    NotFinite { particle: u64, quantity: &'static str, value: f64 },
    #[error(
        "the spring from particle {particle} to {other} is {value:.4} times its rest length, more than the limit of {limit}"
    )]
    Stretch { particle: u64, other: u64, value: f64, limit: f64 },
    #[error(
        "kinetic and elastic energy came to {value:.6e} J, more than the limit of {limit} J (fastest particle: {particle})"
    )]
    Energy { particle: u64, value: f64, limit: f64 },
    #[error("the linear solver cannot go on: {outcome}")]
    Solver { outcome: Outcome },
    #[error(
        "the time step of {dt:.4e} s is above the bound '{bound}' of {limit:.4e} s at particle {particle}: let the step be certified, fix a smaller one, or mark it unchecked"
    )]
    TimeStep { particle: u64, dt: f64, limit: f64, bound: &'static str },
    #[error(
        "more than {limit} steps of the snow are needed within this step of the scene: the bound '{bound}' at particle {particle} allows {dt:.4e} s (shorten the scene's dt, or look at why the snow hardens)"
    )]
    Substeps { particle: u64, dt: f64, limit: u32, bound: &'static str },
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

impl StepFailure {
    /// The same with a body's particles numbered over all bodies, of which `first` is its first.
    pub(crate) fn shifted(mut self, first: u64) -> Self {
        match &mut self {
            Self::NotFinite { particle, .. }
            | Self::Energy { particle, .. }
            | Self::TimeStep { particle, .. }
            | Self::Substeps { particle, .. }
            | Self::NodeSpeed { particle, .. }
            | Self::Deformation { particle, .. }
            | Self::OutOfRange { particle, .. }
            | Self::GridMemory { particle, .. } => *particle += first,
            Self::Stretch { particle, other, .. } => {
                *particle += first;
                *other += first;
            }
            Self::Solver { .. } | Self::Mass { .. } | Self::Interrupted => {}
        }
        self
    }

    /// A stable word for programs, such as `NOT_FINITE`.
    pub const fn reason(&self) -> &'static str {
        match self {
            Self::NotFinite { .. } => "NOT_FINITE",
            Self::Stretch { .. } => "STRETCH_LIMIT",
            Self::Energy { .. } => "ENERGY_LIMIT",
            Self::Solver { .. } => "SOLVER_FAILED",
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

    /// The particle at fault.
    pub const fn particle(&self) -> Option<u64> {
        match self {
            Self::NotFinite { particle, .. }
            | Self::Stretch { particle, .. }
            | Self::Energy { particle, .. }
            | Self::TimeStep { particle, .. }
            | Self::Substeps { particle, .. }
            | Self::NodeSpeed { particle, .. }
            | Self::Deformation { particle, .. }
            | Self::OutOfRange { particle, .. }
            | Self::GridMemory { particle, .. } => Some(*particle),
            Self::Solver { .. } | Self::Mass { .. } | Self::Interrupted => None,
        }
    }

    /// The value at fault.
    pub const fn value(&self) -> Option<f64> {
        match self {
            Self::NotFinite { value, .. }
            | Self::Stretch { value, .. }
            | Self::Energy { value, .. }
            | Self::NodeSpeed { value, .. }
            | Self::Deformation { value, .. }
            | Self::Mass { found: value, .. } => Some(*value),
            Self::GridMemory { bytes, .. } => Some(*bytes as f64),
            Self::TimeStep { dt, .. } | Self::Substeps { dt, .. } => Some(*dt),
            Self::Solver { .. } | Self::OutOfRange { .. } | Self::Interrupted => None,
        }
    }
}
