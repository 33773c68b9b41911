//! Solids filled with particles: boxes, balls and the insides of closed meshes.
//!
//! Reads a solid, a rule for positions and a number of particles; writes positions. Everything random
//! is seeded, and has the same bits on every platform. Modules in reading order:

mod hash;
mod noise;
mod inside;
mod solid;
mod lattice;
mod poisson;
mod sample;
mod overlap;
#[cfg(test)]
mod tests;

pub(crate) use hash::Stream;
pub(crate) use lattice::{Jitter, TooMuch};
pub(crate) use noise::Noise;
pub(crate) use overlap::{SharedByParts, TOLD, count_once, shared_box, shared_by_parts, shared_volume};
pub(crate) use sample::{Arrangement, Count, estimate, fill};
pub(crate) use solid::{Solid, met_blocks};
