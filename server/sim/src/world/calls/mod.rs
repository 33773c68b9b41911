//! What calls may change between two steps, and why a change is refused.
//!
//! Enters: changes, and what the bodies of a world are. Leaves: which of them are accepted. Modules in reading order:

pub(crate) mod collider_move;
pub(crate) mod changes;
pub(crate) mod figures;
mod cloth_check;
mod apart;
mod ranges;
pub(crate) mod rules;
