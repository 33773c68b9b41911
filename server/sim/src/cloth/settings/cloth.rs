//! How a cloth is stepped: integrator, linear solver, limits.

use serde::{Deserialize, Serialize};

use super::{integrator::Integrator, rest::RestSettings, surface::SurfaceSettings};
use crate::{
    linalg::{AtCap, PreconditionerKind, SolverSettings, Stop},
    names::names,
    time_step::TimeStep,
};

/// What springs add to the matrix at a particle, h² k + h nu added up, over its mass on average, from which on `auto` is
/// `two_level`: docs/decisions/0013-affine-coarse-spaces.md has iterations and times of both.
const STIFF: f64 = 1000.0;

/// What the matrix of an implicit step does with compressed springs, whose transverse
/// stiffness k (1 - l0/l) is negative (the matrix can then be indefinite). The matrices of Newton's method are those that
/// it names, but for [`Self::Absolute`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum Hessian {
    /// Keeps it: exact, and unstable under compression at large steps.
    Full,
    /// max(0, 1 - l0/l): positive semi-definite, overshoots under compression.
    Clamped,
    /// |1 - l0/l|: positive semi-definite, the safe choice for one solve per step. Newton's method adds as much of it to
    /// the exact tangent as a solve needs, and none where the exact one is positive definite.
    #[default]
    Absolute,
}

names!(Hessian { Full: "full", Clamped: "clamped", Absolute: "absolute" });

impl Hessian {
    /// What the ratio 1 - l0/l is multiplied by where that makes it greater.
    pub(crate) fn mirror(self) -> f64 {
        match self {
            Self::Full => 1.0,
            Self::Clamped => 0.0,
            Self::Absolute => -1.0,
        }
    }
}

/// Ways of solving the minimisation that an implicit step stands for, as scenes name them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum MinimizerKind {
    /// One linear solve, and more where it does not do what it promised; see [`Minimizer`], for all of them.
    #[default]
    Auto,
    /// One linear solve.
    OneStep,
    /// Linear solves from iterate to iterate, until forces and inertia balance.
    Newton,
    /// Particles one by one, sweep after sweep.
    VertexBlockDescent,
}

names!(MinimizerKind {
    Auto: "auto",
    OneStep: "one_step",
    Newton: "newton",
    VertexBlockDescent: "vertex_block_descent",
});

/// How the minimisation that an implicit step stands for is solved.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Minimizer {
    /// That of [`Self::OneStep`]; where what is minimised falls less than the solve promised, Newton's method goes on from there. Steps
    /// that are unchecked, and those of cloth with a thickness, make the one solve.
    Auto {
        /// How much of the energy that moves and is stretched the fall may lack of what was promised; above 0.
        accuracy: f64,
    },
    /// One linear solve, the first step of Newton's method (Baraff and Witkin 1998).
    OneStep,
    /// Newton's method with a line search.
    Newton(NewtonSettings),
    /// Vertex block descent (Chen et al. 2024): each particle in turn goes to its own minimum to second order, the others held.
    VertexBlockDescent {
        /// How often all particles go.
        sweeps: u32,
    },
}

impl Default for Minimizer {
    fn default() -> Self {
        Self::Auto { accuracy: Self::DEFAULT_ACCURACY }
    }
}

impl Minimizer {
    /// What a fall may lack of what a solve promised where nothing else is asked for, as a share of the energy that moves and is
    /// stretched.
    pub const DEFAULT_ACCURACY: f64 = 0.002;

    /// Sweeps of vertex block descent where nothing else is asked for.
    pub const DEFAULT_SWEEPS: u32 = 20;

    /// When its linear solves stop where nothing else is asked for. What a change of Newton's method is off by, the next one
    /// makes up for, but a change that ends early takes more of them.
    pub fn default_stop(self) -> Stop {
        match self {
            Self::Newton(_) => Stop::Residual { tolerance: 1e-2, max_iterations: 2000 },
            Self::Auto { .. } | Self::OneStep | Self::VertexBlockDescent { .. } => {
                SolverSettings::default().stop
            }
        }
    }

    /// Which way it is.
    pub const fn kind(self) -> MinimizerKind {
        match self {
            Self::Auto { .. } => MinimizerKind::Auto,
            Self::OneStep => MinimizerKind::OneStep,
            Self::Newton(_) => MinimizerKind::Newton,
            Self::VertexBlockDescent { .. } => MinimizerKind::VertexBlockDescent,
        }
    }
}

/// When Newton's method ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NewtonSettings {
    /// Largest acceleration (m/s²) that forces and inertia of a particle may leave over; what the precision cannot
    /// reach counts as reached.
    pub tolerance: f64,
    /// Linear solves, at most.
    pub max_iterations: u32,
}

impl Default for NewtonSettings {
    fn default() -> Self {
        Self { tolerance: 0.01, max_iterations: 50 }
    }
}

/// What becomes of a sub-step in which particles go through or into a collider.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum OnPass {
    /// It is taken, counted and told.
    #[default]
    Warn,
    /// It is taken again at half the length, as one that is not accepted.
    Reject,
}

names!(OnPass { Warn: "warn", Reject: "reject" });

/// When a cloth's state counts as having left what the scene allows.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct StateLimits {
    /// Largest length over rest length of any spring, and of any triangle of a membrane along its threads.
    pub max_stretch: Option<f64>,
    /// Largest kinetic plus elastic energy (J).
    pub max_energy: Option<f64>,
}

/// How a cloth is stepped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClothSettings {
    /// How positions and velocities are advanced.
    pub integrator: Integrator,
    /// How its minimisation is solved, of implicit integrators.
    pub minimizer: Minimizer,
    /// Treatment of compressed springs, for implicit integrators.
    pub hessian: Hessian,
    /// Linear solver, for implicit integrators.
    pub solver: SolverSettings,
    /// How a step of the world is divided. All cloths of a world share their sub-steps: the shortest that one asks for.
    pub time_step: TimeStep,
    /// Largest error (m) that a position may have by the estimate of a sub-step: a step with more is taken again
    /// shorter. None: any.
    pub tolerance: Option<f64>,
    /// What becomes of a sub-step in which particles go through a collider.
    pub on_pass: OnPass,
    /// How its surface meets itself.
    pub contact: SurfaceSettings,
    /// When the state counts as diverged; none by default.
    pub limits: StateLimits,
    /// When pieces of it count as calm, and whether it sleeps then; none: nothing is watched.
    pub rest: Option<RestSettings>,
    /// Particles per block: the unit of parallel work and of sums. A power of two, 32 to 4096.
    /// Part of the scene: results depend on it, never on the number of threads.
    pub block_size: usize,
}

impl Default for ClothSettings {
    fn default() -> Self {
        Self {
            integrator: Integrator::ImplicitEuler,
            minimizer: Minimizer::default(),
            hessian: Hessian::default(),
            solver: SolverSettings::default(),
            time_step: TimeStep::default(),
            tolerance: None,
            on_pass: OnPass::default(),
            contact: SurfaceSettings::default(),
            limits: StateLimits::default(),
            rest: None,
            block_size: Self::DEFAULT_BLOCK_SIZE,
        }
    }
}

impl ClothSettings {
    /// The block size of a scene that names none.
    pub const DEFAULT_BLOCK_SIZE: usize = 256;

    /// Whether steps make their one linear solve from the state itself: BDF2 starts from where the steps before lead.
    pub(crate) fn solves_from_state(&self) -> bool {
        self.starts_with_one_solve()
            && matches!(self.integrator, Integrator::ImplicitEuler | Integrator::ImplicitMidpoint)
    }

    /// Whether steps make one linear solve, and no more unless they need it.
    pub(crate) fn starts_with_one_solve(&self) -> bool {
        matches!(self.minimizer, Minimizer::Auto { .. } | Minimizer::OneStep)
    }

    /// How much of the energy that moves and is stretched a fall may lack of what a solve promised, where steps go on that lack more.
    pub(crate) fn accuracy(&self) -> Option<f64> {
        match self.minimizer {
            Minimizer::Auto { accuracy } if !self.time_step.is_unchecked() => Some(accuracy),
            _ => None,
        }
    }

    /// When the solves of a step stop: whether a cap was meant.
    pub(crate) fn stop(&self) -> Stop {
        match self.minimizer {
            Minimizer::Auto { .. } | Minimizer::OneStep => self.solver.stop,
            Minimizer::Newton(NewtonSettings { tolerance, max_iterations }) => {
                Stop::Residual { tolerance, max_iterations }
            }
            Minimizer::VertexBlockDescent { sweeps } => Stop::Iterations(sweeps),
        }
    }

    /// Whether steps evaluate other states than those that they lead to.
    pub(crate) fn has_iterates(&self) -> bool {
        let makes_one = self.starts_with_one_solve() && self.accuracy().is_none();
        self.integrator.is_implicit() && !(makes_one && self.integrator == Integrator::ImplicitEuler)
    }

    /// Whether steps move particles one by one.
    pub(crate) fn has_sweeps(&self) -> bool {
        self.integrator.is_implicit() && matches!(self.minimizer, Minimizer::VertexBlockDescent { .. })
    }

    /// Whether steps solve with a preconditioner that has a coarse space.
    pub(crate) fn has_coarse_space(&self) -> bool {
        self.solves() && self.solver.preconditioner == PreconditionerKind::TwoLevel
    }

    /// Whether steps solve with patches, from the first one on or where a solve comes to its cap.
    pub(crate) fn has_patches(&self) -> bool {
        self.solves() && (self.solver.preconditioner == PreconditionerKind::Patches || self.may_switch())
    }

    /// Whether a solve that comes to its cap may go on with patches.
    pub(crate) fn may_switch(&self) -> bool {
        self.solver.at_cap == AtCap::Patches && matches!(self.solver.stop, Stop::Residual { .. })
    }

    /// Whether linear solves of iterates add as much of the absolute tangent to the exact one as they need.
    pub(crate) fn mixes_tangents(&self) -> bool {
        let goes_on = matches!(self.minimizer, Minimizer::Newton(_) | Minimizer::Auto { .. });
        goes_on && self.hessian == Hessian::Absolute
    }

    /// Whether steps solve linear systems.
    pub(crate) fn solves(&self) -> bool {
        self.integrator.is_implicit() && !self.has_sweeps()
    }

    /// Whether `auto` is `two_level` for so many particles, of this mass (kg), with springs whose stiffness (N/m) and damping
    /// (N s/m) are these in sum, in steps of the world of `dt` (s).
    pub fn is_stiff(&self, particles: u64, mass: f64, [stiffness, damping]: [f64; 2], dt: f64) -> bool {
        particles > self.block_size as u64 && self.has_stiff_springs(mass, [stiffness, damping], dt)
    }

    /// The same for any number of particles: whether solves may come to their cap, and then go on with patches.
    pub fn has_stiff_springs(&self, mass: f64, [stiffness, damping]: [f64; 2], dt: f64) -> bool {
        let h = self.time_step.asked(dt);
        let is_solved = self.solves() && matches!(self.solver.stop, Stop::Residual { .. });
        // Both ends of a spring feel it.
        is_solved && 2.0 * h * (h * stiffness + damping) > STIFF * mass
    }
}
