//! Explicit Euler: x' = x + h v, v' = v + h a(x, v) (Zara 2001, section 3.2).
//!
//! Without damping it always gains energy, by a factor 1 + (h omega)² per step.

use super::stages::Step;
use crate::math::Real;

pub(super) fn advance<R: Real>(step: &mut Step<'_, R>) {
    step.accelerate();
    step.drift(step.dt());
    step.kick(step.dt());
}
