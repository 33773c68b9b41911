//! Velocity Verlet, kick-drift-kick: w = v + h/2 a(x, v), x' = x + h w, v' = w + h/2 a(x', w).
//!
//! Stable for h omega < 2 without damping. The predicted form ends with
//! v' = w + h/2 a(x', w + h/2 a(x, v)), which keeps order 2 with damping.

use super::update::{MovedBy, Step};
use crate::math::Real;

pub(super) fn advance<R: Real>(step: &mut Step<'_, R>) -> f64 {
    let half = step.dt() * R::of(0.5);
    step.kick_and_drift(half, MovedBy::New);
    step.accelerate();
    step.kick_again(half);
    step.error_of_kicks()
}

pub(super) fn advance_predicted<R: Real>(step: &mut Step<'_, R>) -> f64 {
    let half = step.dt() * R::of(0.5);
    step.kick_and_drift(half, MovedBy::New);
    step.accelerate_ahead(half);
    step.kick_again(half);
    step.error_of_kicks()
}
