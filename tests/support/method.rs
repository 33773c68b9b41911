//! The axis "method": every integrator, and for the implicit ones every treatment of the Hessian.

use nappe_sim::cloth::{Hessian, Integrator};

/// An integrator with its treatment of compressed springs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Method {
    /// How a step advances positions and velocities.
    pub integrator: Integrator,
    /// Treatment of compressed springs; of no effect on explicit integrators.
    pub hessian: Hessian,
}

impl Method {
    /// Every method, by construction.
    pub fn all() -> Vec<Self> {
        let of = |integrator: Integrator| {
            let treatments: &[Hessian] =
                if integrator.is_implicit() { &Hessian::ALL } else { &[Hessian::Absolute] };
            treatments.iter().map(move |&hessian| Self { integrator, hessian })
        };
        Integrator::ALL.into_iter().flat_map(of).collect()
    }

    /// The method that golden tables call by this name: there `implicit_euler` keeps the full
    /// Hessian. `None` for a method that the program does not have.
    pub fn of_golden(name: &str) -> Option<Self> {
        if name == "implicit_euler_clamped" {
            return Some(Self { integrator: Integrator::ImplicitEuler, hessian: Hessian::Clamped });
        }
        let integrator = Integrator::ALL.into_iter().find(|i| i.name() == name)?;
        let hessian = if integrator.is_implicit() { Hessian::Full } else { Hessian::Absolute };
        Some(Self { integrator, hessian })
    }

    /// `velocity_verlet`, `implicit_euler_full`, ...
    pub fn name(self) -> String {
        if self.integrator.is_implicit() {
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
            Integrator::VelocityVerlet | Integrator::VelocityVerletPredicted => 2.0,
            Integrator::ExplicitEuler | Integrator::SymplecticEuler | Integrator::ImplicitEuler => 1.0,
        }
    }
}
