//! Symplectic Euler: v' = v + h a(x, v), x' = x + h v' (the course's "semi-implicit").
//!
//! Stable for h omega < 2 (sqrt(1 + xi²) - xi), xi the damping ratio.

use super::update::{MovedBy, Step};
use crate::math::Real;

pub(super) fn advance<R: Real>(step: &mut Step<'_, R>) -> f64 {
    step.kick_and_drift(step.dt(), MovedBy::New);
    step.error_of_accelerations()
}
