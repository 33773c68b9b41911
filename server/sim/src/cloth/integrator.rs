//! The integrators, as scenes name them. Definitions are in docs/laws/integrators.md, code in `integrate/`.

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
    /// One linear solve per step (Baraff and Witkin 1998; Zara 2001, eq. 1-3).
    ImplicitEuler,
}

impl Integrator {
    /// Every integrator, explicit ones first.
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
