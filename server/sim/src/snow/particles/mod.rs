//! Particles: sixteen at a time, and where each of their numbers is stored.

mod group;
mod layout;
mod in_order;

pub(super) use group::{Constants, Group, Lanes, NewLanes};
pub(super) use layout::{Motion, Particles, SharedParticles};
