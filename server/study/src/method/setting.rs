//! How a case is stepped in a run: a method, a precision, steps.

use nappe_sim::{
    cloth::{ClothSettings, Minimizer, NewtonSettings, StateLimits},
    linalg::Stop,
    math::Precision,
    time_step::TimeStep,
    world::WorldSetup,
};

use super::of_cloth::Method;
use crate::case::Case;

/// Relative residual at which linear solves end: it changes the error of implicit Euler by less than 0.12 %.
const SOLVER_TOLERANCE: f64 = 1e-4;
/// The error that matters (m) for which that is enough; solves end at less where less matters.
const ENOUGH_FOR: f64 = 1e-3;
/// Iterations of a linear solve, at most, where the scene allows fewer.
const SOLVER_ITERATIONS: u32 = 1000;

/// Sub-steps of a step of the world, at most: it tells of a failure at its end.
const SUBSTEPS: u32 = 256;
/// The same where the scene says how long steps of the world are: what the numerics allow.
const MOST_SUBSTEPS: u32 = 8192;

/// What a scene can ask for: an acceleration (m/s²) that Newton's method leaves, a relative residual of linear solves.
const NEWTON_TOLERANCES: [f64; 2] = [1e-12, 1e6];
const LEAST_RESIDUAL: f64 = 1e-15;

/// How long steps are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Steps {
    /// All of the comparison interval over this power of two, whatever is known of them.
    Divided(u32),
    /// All of the scene's time step over this number, as a scene asks for them: within the certified bound, or accepted.
    Fixed(u32),
    /// As long as an error (m) of positions per step allows.
    Controlled(f64),
    /// Certified at this share of the bound, or accepted, within steps of the world of the comparison interval.
    Certified(f64),
    /// As the scene is written; so is all else.
    Own,
}

/// A method, a precision, steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// How a step is made.
    pub method: Method,
    /// Of positions and velocities.
    pub precision: Precision,
    /// How long steps are.
    pub steps: Steps,
    /// Relative residual at which linear solves end.
    pub solver_tolerance: f64,
}

/// What a run is built from, and how the comparison interval is divided.
pub(crate) struct Plan {
    pub(crate) setup: WorldSetup,
    /// Steps of the world in an interval.
    pub(crate) steps: u64,
}

impl Plan {
    /// The same within what the scene allows of its state, and of the steps of its snow.
    pub(crate) fn limited_as(mut self, case: &Case) -> Self {
        for (body, own) in self.setup.bodies.iter_mut().zip(&case.setup.bodies) {
            body.settings.limits = own.settings.limits;
        }
        if let (Some(snow), Some(own)) = (&mut self.setup.snow, &case.setup.snow) {
            snow.settings.max_energy = own.settings.max_energy;
            snow.settings.max_substeps = own.settings.max_substeps;
        }
        self
    }
}

impl Setting {
    /// With linear solves that are enough for an error of a millimetre.
    pub const fn new(method: Method, precision: Precision, steps: Steps) -> Self {
        Self { method, precision, steps, solver_tolerance: SOLVER_TOLERANCE }
    }

    /// The same with linear solves that are enough for an error (m).
    #[must_use]
    pub fn good_to(self, error: f64) -> Self {
        let solver_tolerance = (SOLVER_TOLERANCE * (error / ENOUGH_FOR).min(1.0)).max(LEAST_RESIDUAL);
        Self { solver_tolerance, ..self }
    }

    /// The same with solves as good as a comparison to an error (m) until a time (s) needs, and as many sweeps as the scene
    /// asks for.
    pub(crate) fn solved(self, case: &Case, error: f64, until: f64) -> Self {
        let [least, most] = NEWTON_TOLERANCES;
        let tolerance = (error / (50.0 * until * until)).clamp(least, most);
        let newton = NewtonSettings { tolerance, ..NewtonSettings::default() };
        let own = case.setup.bodies.iter().find_map(|body| match body.settings.minimizer {
            Minimizer::VertexBlockDescent { sweeps } => Some(sweeps),
            _ => None,
        });
        let method = self.method.with(newton, own.unwrap_or(Minimizer::DEFAULT_SWEEPS));
        Self { method, ..self }.good_to(error)
    }

    /// The name of its method, with `_controlled` where steps are as long as an error allows.
    pub fn name(&self) -> String {
        match self.steps {
            Steps::Controlled(_) => format!("{}_controlled", self.method.name()),
            Steps::Divided(_) | Steps::Fixed(_) | Steps::Certified(_) | Steps::Own => self.method.name(),
        }
    }

    /// The length (s) of all steps in a comparison interval (s), where they are equal.
    pub(crate) fn dt(&self, interval: f64) -> Option<f64> {
        match self.steps {
            Steps::Divided(level) => Some(interval / f64::from(level).exp2()),
            Steps::Fixed(_) | Steps::Controlled(_) | Steps::Certified(_) | Steps::Own => None,
        }
    }

    /// Whether its steps fit into those of the world: where pins move, and where these are divided.
    pub(crate) fn fits(&self, case: &Case, interval: f64) -> bool {
        if let Steps::Fixed(parts) = self.steps {
            return parts <= MOST_SUBSTEPS;
        }
        match self.dt(interval) {
            Some(dt) if case.has_moving_pins() => {
                (1.0..=f64::from(MOST_SUBSTEPS)).contains(&(case.dt() / dt))
            }
            _ => true,
        }
    }

    /// What a run of a case is built from, in which times are an interval (s) apart.
    pub(crate) fn plan(&self, case: &Case, interval: f64) -> Plan {
        let mut setup = case.setup.clone();
        if self.steps != Steps::Own {
            let is_free = !case.has_moving_pins();
            setup.dt = match (is_free, self.steps) {
                (true, Steps::Divided(level)) => {
                    interval / f64::from(level).exp2() * f64::from(SUBSTEPS.min(1 << level.min(30)))
                }
                (true, Steps::Certified(_)) => interval,
                (true, Steps::Controlled(_)) => interval.min(case.dt()),
                (true, Steps::Fixed(_) | Steps::Own) | (false, _) => case.dt(),
            };
            setup.bodies.iter_mut().for_each(|body| self.configure(&mut body.settings, interval));
            if let Steps::Fixed(parts) = self.steps {
                let dt = case.dt() / f64::from(parts);
                setup.bodies.iter_mut().for_each(|body| body.settings.time_step = TimeStep::Fixed(dt));
            }
        }
        let steps = (interval / setup.dt).round().max(1.0) as u64;
        Plan { setup, steps }
    }

    /// When linear solves end, of a scene that allows so many iterations.
    pub fn stop(&self, max_iterations: u32) -> Stop {
        Stop::Residual {
            tolerance: self.solver_tolerance,
            max_iterations: max_iterations.max(SOLVER_ITERATIONS),
        }
    }

    /// Has a cloth stepped so, in comparison intervals (s).
    pub(crate) fn configure(&self, settings: &mut ClothSettings, interval: f64) {
        if self.steps == Steps::Own {
            return;
        }
        let Method { integrator, minimizer, hessian } = self.method;
        (settings.integrator, settings.minimizer, settings.hessian) = (integrator, minimizer, hessian);
        settings.solver.stop = self.stop(match settings.solver.stop {
            Stop::Residual { max_iterations, .. } => max_iterations,
            Stop::Iterations(_) => 0,
        });
        (settings.time_step, settings.tolerance) = match self.steps {
            Steps::Controlled(tolerance) => (TimeStep::default(), Some(tolerance)),
            Steps::Certified(safety) => (TimeStep::Certified { safety }, None),
            Steps::Divided(_) | Steps::Fixed(_) | Steps::Own => {
                (TimeStep::Unchecked(self.dt(interval).unwrap_or(interval)), None)
            }
        };
        // What a scene allows of its state is no property of a method.
        settings.limits = StateLimits::default();
    }
}
