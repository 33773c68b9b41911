//! What colliders do to the velocity of snow, one alone or several at once.
//!
//! Enters: a velocity (m/s), and the colliders that it meets. Leaves: the velocity afterwards. Modules in reading order:

pub(crate) mod velocity;
pub(crate) mod corner;
