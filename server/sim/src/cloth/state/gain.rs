//! What is known of the energy of a cloth over the run.

use serde::{Deserialize, Serialize};

/// What is known of the energy over a run.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Gain {
    /// Of explicit steps: by how much it (J) is above that of the start, what pins, the medium and colliders gave since taken off.
    /// Of implicit ones: what contacts gave and nothing paid back yet.
    pub(crate) energy: f64,
    /// Of explicit steps: the same of what their method keeps of linear motion.
    pub(crate) kept: f64,
    /// The longest sub-step so far over its bound.
    pub(crate) ratio: f64,
    /// Of explicit steps: the most that moved and was stretched so far (J), less what was gained by then.
    pub(crate) motion: f64,
}

impl Gain {
    /// Of explicit steps: by how much the energy grew (J), which neither swings about what the method keeps nor hides in it.
    pub(crate) fn grown(&self) -> f64 {
        self.energy.min(self.kept)
    }
}
