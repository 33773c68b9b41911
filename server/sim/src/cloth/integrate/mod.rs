//! Integrators, one file each; definitions in docs/laws/integrators.md.
//!
//! Each reads a model, frozen parameters and a state, and writes the state one step later.
//! h = dt; a(x, v) = (springs + drag) / m + g, 0 for pins, whose velocity is prescribed.

mod explicit_euler;
mod implicit_euler;
mod stages;
mod symplectic_euler;
mod velocity_verlet;

use stages::Step;

use super::{ClothSettings, model::Model, state::State, state::Workspace};
use crate::{
    linalg::SolveReport,
    math::Real,
    report::{StepFailure, Stopwatch},
};

/// How positions and velocities are advanced by a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Integrator {
    /// x' = x + h v, v' = v + h a(x, v).
    ExplicitEuler,
    /// v' = v + h a(x, v), x' = x + h v' (the course's "semi-implicit").
    SymplecticEuler,
    /// Kick, drift, kick (leapfrog).
    VelocityVerlet,
    /// The same with the end velocity predicted before the second kick: order 2 with damping.
    VelocityVerletPredicted,
    /// One linear solve a step (Baraff and Witkin 1998; Zara 2001, eq. 1-3).
    ImplicitEuler,
}

impl Integrator {
    /// Every integrator.
    pub const ALL: [Self; 5] = [
        Self::ExplicitEuler,
        Self::SymplecticEuler,
        Self::VelocityVerlet,
        Self::VelocityVerletPredicted,
        Self::ImplicitEuler,
    ];

    /// Its name in scene files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::ExplicitEuler => "explicit_euler",
            Self::SymplecticEuler => "symplectic_euler",
            Self::VelocityVerlet => "velocity_verlet",
            Self::VelocityVerletPredicted => "velocity_verlet_pc",
            Self::ImplicitEuler => "implicit_euler",
        }
    }

    /// Order of convergence in the time step without damping. Plain velocity Verlet has order 1
    /// with damping, since it takes the end force at the velocity of the middle.
    pub const fn order(self) -> u32 {
        match self {
            Self::VelocityVerlet | Self::VelocityVerletPredicted => 2,
            Self::ExplicitEuler | Self::SymplecticEuler | Self::ImplicitEuler => 1,
        }
    }

    /// Whether a step solves a linear system.
    pub const fn is_implicit(self) -> bool {
        matches!(self, Self::ImplicitEuler)
    }
}

/// Advances `state` by `dt` (s).
pub(super) fn advance<R: Real>(
    model: &Model<R>,
    settings: &ClothSettings,
    state: &mut State<R>,
    work: &mut Workspace<R>,
    dt: f64,
    watch: &mut dyn Stopwatch,
) -> Result<Option<SolveReport>, StepFailure> {
    let mut step = Step { model, state, work, dt: R::of(dt), watch };
    match settings.integrator {
        Integrator::ExplicitEuler => explicit_euler::advance(&mut step),
        Integrator::SymplecticEuler => symplectic_euler::advance(&mut step),
        Integrator::VelocityVerlet => velocity_verlet::advance(&mut step),
        Integrator::VelocityVerletPredicted => velocity_verlet::advance_predicted(&mut step),
        Integrator::ImplicitEuler => return implicit_euler::advance(&mut step, settings).map(Some),
    }
    Ok(None)
}
