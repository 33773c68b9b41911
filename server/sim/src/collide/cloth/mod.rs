//! What a particle of cloth does that meets colliders: whether it passed, where it touched, how it goes on.
//!
//! Enters: colliders, positions and velocities at both ends of a sub-step. Leaves: where each particle ends, and what was
//! pushed. Modules in reading order:

mod facing;
pub(crate) mod passed;
mod flight;
mod planes;
pub(crate) mod touch;
mod crease;
mod answer;
pub(crate) mod approach;
mod pinch;
pub(crate) mod contact;
