//! Particles: sixteen at a time, and where each of their numbers is stored.

mod group;
mod motion;
mod layout;
mod in_order;
mod packed;

pub(super) use group::{Constants, Group, Lanes, NewLanes};
pub(super) use layout::{Particles, SharedParticles};
pub(super) use motion::Motion;
