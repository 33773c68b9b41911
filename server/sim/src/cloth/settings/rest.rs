//! How still cloth has to lie before it counts as calm.

use serde::{Deserialize, Serialize};

/// The share of the error that each rule may take: a fifth.
const SHARE: f64 = 0.2;

/// What a scene allows cloth that lies still to be off, and for how long.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RestSettings {
    /// Error (m) that leaving out what is calm may make; above 0, and at least [`Self::LEAST_ROUNDINGS`] of the largest
    /// coordinate.
    pub error: f64,
    /// Time (s) over which the error may add up, above 0.
    pub within: f64,
    /// Whether what is calm sleeps; else it is watched, and no step depends on it.
    pub sleep: bool,
}

impl RestSettings {
    /// The least error, in roundings of the largest coordinate: below it, rounding alone looks like motion.
    pub const LEAST_ROUNDINGS: f64 = 200.0;

    /// The part of the error (m) that the rules divide.
    pub(crate) fn share(self) -> f64 {
        SHARE * self.error
    }
}
