//! The integrators, as scenes name them. Definitions are in docs/laws/integrators.md, code in `integrate/`.

use serde::{Deserialize, Serialize};

use crate::{names::names, report::BoundKind};

/// How positions and velocities are advanced by a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Integrator {
    /// x' = x + h v, v' = v + h a(x, v).
    ExplicitEuler,
    /// v' = v + h a(x, v), x' = x + h v' (the course's "semi-implicit").
    SymplecticEuler,
    /// Kick, drift, kick (leapfrog).
    VelocityVerlet,
    /// The same with the end velocity predicted before the second kick: order 2 with damping.
    VelocityVerletPredicted,
    /// x' = x + h v', v' = v + h a(x', v') (Baraff and Witkin 1998; Zara 2001, eq. 1-3).
    ImplicitEuler,
    /// x' = x + h u, v' = v + h a(x + h u / 2, u), u = (v + v') / 2: keeps the energy of linear motion.
    ImplicitMidpoint,
    /// Backward differences over two steps, of any lengths: order 2, with little damping.
    Bdf2,
}

names!(Integrator {
    ExplicitEuler: "explicit_euler",
    SymplecticEuler: "symplectic_euler",
    VelocityVerlet: "velocity_verlet",
    VelocityVerletPredicted: "velocity_verlet_pc",
    ImplicitEuler: "implicit_euler",
    ImplicitMidpoint: "implicit_midpoint",
    Bdf2: "bdf2",
});

impl Integrator {
    /// Order of convergence in the time step without damping. Plain velocity Verlet has order 1
    /// with damping, since it takes the end force at the velocity of the middle.
    pub const fn order(self) -> u32 {
        match self {
            Self::VelocityVerlet | Self::VelocityVerletPredicted | Self::ImplicitMidpoint | Self::Bdf2 => 2,
            Self::ExplicitEuler | Self::SymplecticEuler | Self::ImplicitEuler => 1,
        }
    }

    /// Whether a step solves for the end of itself.
    pub const fn is_implicit(self) -> bool {
        matches!(self, Self::ImplicitEuler | Self::ImplicitMidpoint | Self::Bdf2)
    }

    /// Whether a step knows of the one before.
    pub(crate) const fn has_past(self) -> bool {
        matches!(self, Self::ImplicitMidpoint | Self::Bdf2)
    }

    /// What bounds the length of its steps, where it is explicit.
    pub(crate) const fn bound(self) -> BoundKind {
        match self {
            Self::ExplicitEuler => BoundKind::Damping,
            _ => BoundKind::Stiffness,
        }
    }
}
