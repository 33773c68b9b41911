//! The axis "method": every integrator, and for the implicit ones every treatment of the Hessian.

use nappe_sim::cloth::{Hessian, Integrator, Minimizer, NewtonSettings};

/// An integrator, how its steps are solved, and its treatment of compressed springs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Method {
    /// How a step advances positions and velocities.
    pub integrator: Integrator,
    /// How it is solved; of no effect on explicit integrators.
    pub minimizer: Minimizer,
    /// Treatment of compressed springs; likewise.
    pub hessian: Hessian,
}

/// Newton's method, as far as the precision goes.
pub const NEWTON: Minimizer = Minimizer::Newton(NewtonSettings { tolerance: 1e-12, max_iterations: 50 });

/// Sweeps of vertex block descent that come as far as the precision goes on the small networks of tests.
const MANY_SWEEPS: u32 = 40;

impl Method {
    /// An integrator that makes one linear solve per step, if any.
    pub const fn new(integrator: Integrator, hessian: Hessian) -> Self {
        Self { integrator, minimizer: Minimizer::OneStep, hessian }
    }

    /// The same, solved by some sweeps of vertex block descent.
    pub const fn by_sweeps(integrator: Integrator, sweeps: u32) -> Self {
        let minimizer = Minimizer::VertexBlockDescent { sweeps };
        Self { minimizer, ..Self::new(integrator, Hessian::Absolute) }
    }

    /// Every method, each taken as far as the precision goes: implicit Euler with every treatment of the Hessian.
    pub fn all() -> Vec<Self> {
        let of = |integrator: Integrator| {
            let treatments: &[Hessian] =
                if integrator == Integrator::ImplicitEuler { &Hessian::ALL } else { &[Hessian::Absolute] };
            let newton = Self { integrator, minimizer: NEWTON, hessian: Hessian::Absolute };
            let one_step = treatments.iter().map(move |&hessian| Self::new(integrator, hessian));
            let sweeps = Self::by_sweeps(integrator, MANY_SWEEPS);
            one_step.chain(integrator.is_implicit().then_some([newton, sweeps]).into_iter().flatten())
        };
        Integrator::ALL.into_iter().flat_map(of).collect()
    }

    /// The same with few iterations of Newton's method, or few sweeps: what many do in less time, for tests of how they run.
    #[must_use]
    pub fn in_few_iterations(self) -> Self {
        let few = Minimizer::Newton(NewtonSettings { tolerance: 1e-3, max_iterations: 5 });
        let minimizer = match self.minimizer {
            Minimizer::Newton(_) => few,
            Minimizer::VertexBlockDescent { .. } => Minimizer::VertexBlockDescent { sweeps: 5 },
            Minimizer::OneStep => Minimizer::OneStep,
        };
        Self { minimizer, ..self }
    }

    /// The method that golden tables call by this name: there `implicit_euler` keeps the full
    /// Hessian. `None` for a method that the program does not have.
    pub fn of_golden(name: &str) -> Option<Self> {
        if name == "implicit_euler_clamped" {
            return Some(Self::new(Integrator::ImplicitEuler, Hessian::Clamped));
        }
        let integrator = Integrator::ALL.into_iter().find(|i| i.name() == name)?;
        let hessian = if integrator.is_implicit() { Hessian::Full } else { Hessian::Absolute };
        Some(Self::new(integrator, hessian))
    }

    /// Whether its particles move one by one, without a linear system.
    pub const fn is_by_sweeps(self) -> bool {
        self.integrator.is_implicit() && matches!(self.minimizer, Minimizer::VertexBlockDescent { .. })
    }

    /// `velocity_verlet`, `implicit_euler_full`, ...
    pub fn name(self) -> String {
        if self.minimizer == NEWTON {
            format!("{}_newton", self.integrator.name())
        } else if let Minimizer::VertexBlockDescent { .. } = self.minimizer {
            format!("{}_vertex_block_descent", self.integrator.name())
        } else if self.integrator.is_implicit() {
            format!("{}_{}", self.integrator.name(), self.hessian.name())
        } else {
            self.integrator.name().to_owned()
        }
    }

    /// Order of convergence with springs of this damping (N s/m): plain Verlet takes the damping
    /// force with the velocity of the half step, which costs it an order.
    pub fn order(self, damping: f64) -> f64 {
        match self.integrator {
            Integrator::VelocityVerlet if damping > 0.0 => 1.0,
            Integrator::VelocityVerlet
            | Integrator::VelocityVerletPredicted
            | Integrator::ImplicitMidpoint
            | Integrator::Bdf2 => 2.0,
            Integrator::ExplicitEuler | Integrator::SymplecticEuler | Integrator::ImplicitEuler => 1.0,
        }
    }
}
