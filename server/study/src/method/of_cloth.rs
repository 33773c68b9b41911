//! Every integrator, and of the implicit ones every way of solving and every treatment of the Hessian.

use nappe_sim::{
    cloth::{ClothSettings, Hessian, Integrator, Minimizer, NewtonSettings},
    linalg::Stop,
};

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

/// Sweeps of vertex block descent that come as far as the precision goes on small cloths.
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

    /// Those that are looked at for where they fail: all of them, and what steps a scene that names none.
    pub fn studied() -> Vec<Self> {
        let minimizer = Minimizer::default();
        let default = Self { minimizer, ..Self::new(Integrator::ImplicitEuler, Hessian::Absolute) };
        Self::all().into_iter().chain([default]).collect()
    }

    /// Those that charts and plans compare: all of them, and both other implicit integrators with the exact tangent, which
    /// is what one linear solve is nearest to where steps are small.
    pub(crate) fn compared() -> Vec<Self> {
        let exact = [Integrator::ImplicitMidpoint, Integrator::Bdf2]
            .map(|integrator| Self::new(integrator, Hessian::Full));
        Self::all().into_iter().chain(exact).collect()
    }

    /// Those that runs with controlled steps are made by.
    pub(crate) fn controlled() -> [Self; 3] {
        let newton = Self { minimizer: NEWTON, ..Self::new(Integrator::Bdf2, Hessian::Absolute) };
        [
            Self::new(Integrator::VelocityVerletPredicted, Hessian::Absolute),
            Self::new(Integrator::ImplicitEuler, Hessian::Absolute),
            newton,
        ]
    }

    /// What a step is expected to take before one was made, in evaluations and products: it decides what is tried first.
    pub(crate) const fn expected_count(self) -> u64 {
        match self.minimizer {
            _ if !self.integrator.is_implicit() => 2,
            Minimizer::Auto { .. } | Minimizer::OneStep => 50,
            Minimizer::Newton(_) => 1000,
            Minimizer::VertexBlockDescent { sweeps } => sweeps as u64,
        }
    }

    /// How many times as long an evaluation of it takes as one of all particles at once: one by one takes longer.
    pub(crate) const fn weight(self) -> u64 {
        if self.is_by_sweeps() { 10 } else { 1 }
    }

    /// That by which a cloth is stepped.
    pub fn of(settings: &ClothSettings) -> Self {
        let ClothSettings { integrator, minimizer, hessian, .. } = *settings;
        Self { integrator, minimizer, hessian }
    }

    /// The same with Newton's method ended so, or so many sweeps.
    #[must_use]
    pub const fn with(self, newton: NewtonSettings, sweeps: u32) -> Self {
        let minimizer = match self.minimizer {
            Minimizer::Newton(_) => Minimizer::Newton(newton),
            Minimizer::VertexBlockDescent { .. } => Minimizer::VertexBlockDescent { sweeps },
            Minimizer::Auto { .. } | Minimizer::OneStep => self.minimizer,
        };
        Self { minimizer, ..self }
    }

    /// The relative residual at which linear solves of a cloth that is stepped by it end; none where it makes none, or a
    /// fixed number of iterations.
    pub fn solver_tolerance(self, settings: &ClothSettings) -> Option<f64> {
        match settings.solver.stop {
            Stop::Residual { tolerance, .. } if self.integrator.is_implicit() && !self.is_by_sweeps() => {
                Some(tolerance)
            }
            _ => None,
        }
    }

    /// Whether bodies with a thickness can be stepped by it.
    pub(crate) const fn keeps_apart(self) -> bool {
        matches!(self.integrator, Integrator::ImplicitEuler)
            && matches!(self.minimizer, Minimizer::Auto { .. } | Minimizer::OneStep)
    }

    /// Whether its particles move one by one, without a linear system.
    pub const fn is_by_sweeps(self) -> bool {
        self.integrator.is_implicit() && matches!(self.minimizer, Minimizer::VertexBlockDescent { .. })
    }

    /// `velocity_verlet`, `implicit_euler_full`, `bdf2_newton`, `implicit_euler_auto`, ...
    pub fn name(self) -> String {
        let integrator = self.integrator.name();
        match self.minimizer {
            _ if !self.integrator.is_implicit() => integrator.to_owned(),
            Minimizer::OneStep => format!("{integrator}_{}", self.hessian.name()),
            Minimizer::Auto { .. } | Minimizer::Newton(_) | Minimizer::VertexBlockDescent { .. } => {
                format!("{integrator}_{}", self.minimizer.kind().name())
            }
        }
    }

    /// The same as a reader writes it: `velocity Verlet`, `implicit Euler, exact Hessian`, `BDF2, Newton`, ...
    pub fn reader_name(self) -> String {
        let integrator = match self.integrator {
            Integrator::ExplicitEuler => "explicit Euler",
            Integrator::SymplecticEuler => "symplectic Euler",
            Integrator::VelocityVerlet => "velocity Verlet",
            Integrator::VelocityVerletPredicted => "velocity Verlet, predicted",
            Integrator::ImplicitEuler => "implicit Euler",
            Integrator::ImplicitMidpoint => "implicit midpoint",
            Integrator::Bdf2 => "BDF2",
        };
        let way = match (self.minimizer, self.hessian) {
            (Minimizer::Auto { .. }, _) => "as many solves as needed",
            (Minimizer::OneStep, Hessian::Full) => "exact Hessian",
            (Minimizer::OneStep, Hessian::Clamped) => "clamped Hessian",
            (Minimizer::OneStep, Hessian::Absolute) => "absolute Hessian",
            (Minimizer::Newton(_), _) => "Newton",
            (Minimizer::VertexBlockDescent { .. }, _) => "vertex block descent",
        };
        if self.integrator.is_implicit() { format!("{integrator}, {way}") } else { integrator.to_owned() }
    }

    /// Order of convergence with springs of this damping (N s/m): plain Verlet takes the damping
    /// force with the velocity of the half step, which costs it an order.
    pub fn order(self, damping: f64) -> f64 {
        match self.integrator {
            Integrator::VelocityVerlet if damping > 0.0 => 1.0,
            _ => f64::from(self.integrator.order()),
        }
    }
}
