//! How large a residual is, and what is wrong with it.

use crate::linalg::settings::Outcome;

/// What a solve is to come to.
pub(super) struct Goal {
    pub(super) residual: f64,
    /// Whether no smaller residual can be told from 0 in this precision.
    pub(super) is_rounding: bool,
    /// Iterations that it may make.
    pub(super) cap: u32,
}

/// r.z of an iterate, and the sum of the magnitudes of its terms.
#[derive(Clone, Copy)]
pub(super) struct Residual {
    pub(super) square: f64,
    pub(super) magnitude: f64,
}

impl Residual {
    pub(super) fn residual(self) -> f64 {
        self.square.sqrt()
    }

    /// What is wrong with it after so many iterations, if it is not 0.
    pub(super) fn fault(self, iteration: u32) -> Option<Outcome> {
        if !self.square.is_finite() {
            return Some(Outcome::NotFinite { iteration });
        }
        (self.square <= 0.0 && self.magnitude > 0.0)
            .then_some(Outcome::IndefinitePreconditioner { iteration })
    }
}
