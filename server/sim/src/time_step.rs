//! How a step of the world is divided into the steps of a body.

use serde::{Deserialize, Serialize};

/// How long the steps of a body are within a step of the world, which is divided into equal ones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum TimeStep {
    /// Each as long as the certified bound allows; an implicit step of cloth, which has none, as long as it is accepted.
    Certified {
        /// Share of the bound that is used, above 0 and at most 1.
        safety: f64,
    },
    /// All of this length (s); refused, with the number, when it is above the bound. An implicit step of cloth that is
    /// not accepted is divided further.
    Fixed(f64),
    /// All of this length (s), whatever the bound says: runs may diverge, and say so.
    Unchecked(f64),
}

impl Default for TimeStep {
    fn default() -> Self {
        Self::Certified { safety: Self::SAFETY }
    }
}

impl TimeStep {
    /// Share of the bound that is used by a scene that names none.
    pub const SAFETY: f64 = 0.9;

    /// Equal steps of at most `allowed` (s) that `length` (s) divides into: at least one.
    pub(crate) fn divide(length: f64, allowed: f64) -> f64 {
        // A whole number of steps stays one when the quotient is rounded.
        (length / allowed - 1e-9).ceil().max(1.0)
    }

    /// Whether steps are taken whatever is known of them.
    pub(crate) const fn is_unchecked(self) -> bool {
        matches!(self, Self::Unchecked(_))
    }

    /// Length (s) of those that a step of the world (s) is divided into at least.
    pub(crate) fn asked(self, dt: f64) -> f64 {
        dt / self.count_in(dt)
    }

    /// Steps that a step of the world (s) is divided into at least.
    pub(crate) fn count_in(self, dt: f64) -> f64 {
        match self {
            Self::Certified { .. } => 1.0,
            Self::Fixed(length) | Self::Unchecked(length) => Self::divide(dt, length),
        }
    }
}
