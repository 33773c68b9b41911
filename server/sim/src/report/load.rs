//! What colliders feel of a step.

use serde::{Deserialize, Serialize};

/// What a collider felt in a step of the world: minus the impulses of contact over the step's length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Load {
    /// Mean force (N).
    pub force: [f64; 3],
    /// Mean torque (N m) about the collider's reference point, where that is at the end of the step.
    pub torque: [f64; 3],
    /// Particles of cloth that touched it, each once per sub-step; nodes of snow within it, each once per step of the snow.
    pub contacts: u64,
}
