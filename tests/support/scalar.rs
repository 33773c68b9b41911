//! One degree of freedom advanced by the definition of each integrator, written out in scalars:
//! the independent side of comparisons with a simulation, and of closed forms.

use nappe_sim::cloth::Integrator;

/// a(x, v) = -stiffness x - damping v + force, for unit mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScalarLaw {
    /// Stiffness per mass (1/s²).
    pub stiffness: f64,
    /// Damping per mass (1/s).
    pub damping: f64,
    /// Constant force (m/s²).
    pub force: f64,
}

impl ScalarLaw {
    fn acceleration(&self, x: f64, v: f64) -> f64 {
        self.force - self.stiffness * x - self.damping * v
    }

    /// The state (x, v) `count` steps of `dt` (s) later.
    pub fn run(&self, integrator: Integrator, dt: f64, start: [f64; 2], count: u64) -> [f64; 2] {
        let (mut before, mut now) = (None, start);
        for _ in 0..count {
            let next = match before {
                Some(before) if integrator == Integrator::Bdf2 => self.backward_difference(dt, before, now),
                _ => self.step(integrator, dt, now),
            };
            (before, now) = (Some(now), next);
        }
        now
    }

    /// x'' = (4 x' - x + 2 h v'') / 3, v'' = (4 v' - v + 2 h a(x'', v'')) / 3.
    fn backward_difference(&self, dt: f64, before: [f64; 2], now: [f64; 2]) -> [f64; 2] {
        let [x, v] = [0, 1].map(|c| (4.0 * now[c] - before[c]) / 3.0);
        let h = 2.0 * dt / 3.0;
        let v =
            (v + h * (self.force - self.stiffness * x)) / (1.0 + h * self.damping + h * h * self.stiffness);
        [x + h * v, v]
    }

    /// The state (x, v) one step of `dt` (s) later, from a start without a step before.
    pub fn step(&self, integrator: Integrator, dt: f64, [x, v]: [f64; 2]) -> [f64; 2] {
        let a = self.acceleration(x, v);
        match integrator {
            Integrator::ExplicitEuler => [x + dt * v, v + dt * a],
            Integrator::SymplecticEuler => [x + dt * (v + dt * a), v + dt * a],
            Integrator::VelocityVerlet => {
                let w = v + dt / 2.0 * a;
                let x = x + dt * w;
                [x, w + dt / 2.0 * self.acceleration(x, w)]
            }

            Integrator::VelocityVerletPredicted => {
                let w = v + dt / 2.0 * a;
                let x = x + dt * w;
                [x, w + dt / 2.0 * self.acceleration(x, w + dt / 2.0 * a)]
            }

            Integrator::ImplicitMidpoint => {
                let h = dt / 2.0;
                let u = (v + h * (self.force - self.stiffness * x))
                    / (1.0 + h * self.damping + h * h * self.stiffness);
                [x + dt * u, 2.0 * u - v]
            }

            Integrator::ImplicitEuler | Integrator::Bdf2 => {
                let matrix = 1.0 + dt * self.damping + dt * dt * self.stiffness;
                let v = v + dt * (a - dt * self.stiffness * v) / matrix;
                [x + dt * v, v]
            }
        }
    }

    /// Largest modulus of the eigenvalues of a step.
    pub fn spectral_radius(&self, integrator: Integrator, dt: f64) -> f64 {
        let free = Self { force: 0.0, ..*self };
        let [a, c] = free.step(integrator, dt, [1.0, 0.0]);
        let [b, d] = free.step(integrator, dt, [0.0, 1.0]);
        let (half_trace, determinant) = (f64::midpoint(a, d), a * d - b * c);
        let discriminant = half_trace * half_trace - determinant;
        if discriminant < 0.0 { determinant.sqrt() } else { half_trace.abs() + discriminant.sqrt() }
    }

    /// The first step (s) at which a mode grows, up to `limit`; `None` if none does.
    pub fn critical_step(&self, integrator: Integrator, limit: f64) -> Option<f64> {
        let grows = |dt: f64| self.spectral_radius(integrator, dt) > 1.0 + 1e-12;
        let count = 100_000_u32;
        let at = |i: u32| limit * f64::from(i) / f64::from(count);
        let first = (1..=count).find(|&i| grows(at(i)))?;
        let (mut below, mut above) = (at(first - 1), at(first));
        for _ in 0..60 {
            let middle = f64::midpoint(below, above);
            *(if grows(middle) { &mut above } else { &mut below }) = middle;
        }
        Some(below)
    }
}
