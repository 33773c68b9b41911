//! Explicit Euler: x' = x + h v, v' = v + h a(x, v).
//!
//! Never stable without damping.

use super::update::{MovedBy, Step};
use crate::math::Real;

pub(super) fn advance<R: Real>(step: &mut Step<'_, R>) -> f64 {
    step.kick_and_drift(step.dt(), MovedBy::Old);
    step.error_of_accelerations()
}
