//! Implicit integrators as one minimisation: of |u - V|²_M / 2 + E(X + h u) over velocities u, with another X, V and h
//! each. Damping adds h u.C u / 2.
//!
//! | integrator | h | X - x_n | V - v_n | the step ends at |
//! |---|---|---|---|---|
//! | implicit Euler | H | 0 | 0 | X + h u, u |
//! | implicit midpoint | H / 2 | 0 | 0 | as far again from x_n, v_n |
//! | BDF2 | (1 + r) H / (1 + 2 r) | b (x_n - x_(n-1)) | b (v_n - v_(n-1)) | X + h u, u |
//!
//! H is the length of the sub-step, r that over the length of the one before, b = r² / (1 + 2 r). Without one before r
//! is 0, and BDF2 is implicit Euler. Pins have u = V = v_n, and an X that brings them where they are to be.

use super::integrator::Integrator;

/// The numbers of an integrator for one sub-step.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct Scheme {
    /// h (s).
    pub(crate) h: f64,
    /// b: how much of the change in the sub-step before goes on.
    pub(crate) past: f64,
    /// How far the step ends from its start, over how far X + h u is.
    pub(crate) beyond: f64,
    /// X - x_n over v_n, of pins (s): they end where they are to be.
    pub(crate) of_pins: f64,
}

impl Scheme {
    /// Of a sub-step of `dt` (s) after one of `before` (s), 0 where there is none.
    pub(crate) fn of(integrator: Integrator, dt: f64, before: f64) -> Self {
        let (h, past, beyond) = match integrator {
            Integrator::ImplicitMidpoint => (0.5 * dt, 0.0, 2.0),
            Integrator::Bdf2 if before > 0.0 => {
                let ratio = dt / before;
                let whole = 1.0 + 2.0 * ratio;
                ((1.0 + ratio) * dt / whole, ratio * ratio / whole, 1.0)
            }
            _ => (dt, 0.0, 1.0),
        };
        Self { h, past, beyond, of_pins: dt / beyond - h }
    }
}

/// The leading term of the error of a sub-step of `dt` (s) in each position, over the second difference quotient of
/// velocities (s³), for integrators of order 2. That of BDF2 counts that the state before was as far off the motion
/// through this one.
pub(crate) fn error_constant(integrator: Integrator, dt: f64, before: f64) -> f64 {
    let cube = dt * dt * dt;
    if integrator == Integrator::Bdf2 {
        let ratio = dt / before;
        cube * ((1.0 + ratio) * (1.0 + ratio) + 2.0) / (6.0 * ratio * (1.0 + 2.0 * ratio))
    } else {
        cube / 12.0
    }
}
