//! What steps cost, counted: the same on any machine and for any number of threads.

use serde::{Deserialize, Serialize};

/// Work of the sub-steps that were taken, and of those that were tried and rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Work {
    /// Evaluations of the forces on all particles of a body: sweeps over its springs and elements. A sweep of vertex block
    /// descent is one, and so is a step of snow.
    pub force_evaluations: u64,
    /// Products of the matrix of a body with a vector.
    pub matrix_products: u64,
}

impl Work {
    /// This work and more.
    #[must_use]
    pub const fn and(self, more: Self) -> Self {
        Self {
            force_evaluations: self.force_evaluations + more.force_evaluations,
            matrix_products: self.matrix_products + more.matrix_products,
        }
    }
}
