//! How a cloth is stepped: integrator, linear solver, limits.

use super::integrator::Integrator;
use crate::{
    linalg::{PreconditionerKind, SolverSettings},
    time_step::TimeStep,
};

/// What the matrix of an implicit step does with compressed springs, whose transverse
/// stiffness k (1 - l0/l) is negative (the matrix can then be indefinite).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Hessian {
    /// Keeps it: exact, and unstable under compression at large steps.
    Full,
    /// max(0, 1 - l0/l): positive semi-definite, overshoots under compression.
    Clamped,
    /// |1 - l0/l|: positive semi-definite, the safe choice for one solve per step.
    #[default]
    Absolute,
}

impl Hessian {
    /// Every treatment, from the exact one to the safest.
    pub const ALL: [Self; 3] = [Self::Full, Self::Clamped, Self::Absolute];

    /// Its name in scene files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Clamped => "clamped",
            Self::Absolute => "absolute",
        }
    }

    /// What the ratio 1 - l0/l is multiplied by where that makes it greater.
    pub(crate) fn mirror(self) -> f64 {
        match self {
            Self::Full => 1.0,
            Self::Clamped => 0.0,
            Self::Absolute => -1.0,
        }
    }
}

/// When a cloth's state counts as having left what the scene allows.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct StateLimits {
    /// Largest length over rest length of any spring.
    pub max_stretch: Option<f64>,
    /// Largest kinetic plus elastic energy (J).
    pub max_energy: Option<f64>,
}

/// How a cloth is stepped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClothSettings {
    /// How positions and velocities are advanced.
    pub integrator: Integrator,
    /// Treatment of compressed springs, for implicit integrators.
    pub hessian: Hessian,
    /// Linear solver, for implicit integrators.
    pub solver: SolverSettings,
    /// How a step of the world is divided. All cloths of a world share their sub-steps: the shortest that one asks for.
    pub time_step: TimeStep,
    /// Largest error (m) that a position may have by the estimate of a sub-step: a step with more is taken again
    /// shorter. None: any.
    pub tolerance: Option<f64>,
    /// When the state counts as diverged; none by default.
    pub limits: StateLimits,
    /// Particles per block: the unit of parallel work and of sums. A power of two, 32 to 4096.
    /// Part of the scene: results depend on it, never on the number of threads.
    pub block_size: usize,
}

impl Default for ClothSettings {
    fn default() -> Self {
        Self {
            integrator: Integrator::ImplicitEuler,
            hessian: Hessian::default(),
            solver: SolverSettings::default(),
            time_step: TimeStep::default(),
            tolerance: None,
            limits: StateLimits::default(),
            block_size: Self::DEFAULT_BLOCK_SIZE,
        }
    }
}

impl ClothSettings {
    /// The block size of a scene that names none.
    pub const DEFAULT_BLOCK_SIZE: usize = 256;

    /// Whether steps solve with a preconditioner that has a coarse space.
    pub(super) fn has_coarse_space(&self) -> bool {
        self.integrator.is_implicit() && self.solver.preconditioner == PreconditionerKind::TwoLevel
    }
}
