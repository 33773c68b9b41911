//! Snow in scenes: its text, and particles that fill boxes, balls and closed meshes.
//!
//! Reads `[snow]` and its objects; writes what the simulation is built from. Everything random is
//! seeded, and has the same bits on every platform. Modules in reading order:

mod types;
mod place;
mod hash;
mod noise;
mod closed;
mod inside;
mod solid;
mod lattice;
mod poisson;
mod sample;
mod material;
mod settings;
mod object;
#[cfg(test)]
mod tests;

pub(crate) use object::Plan;
pub(crate) use place::Place;
pub(crate) use settings::settings;
pub(crate) use solid::Placement;
pub use types::{
    AdvectionName, BoxText, MaterialText, Sampling, Snow, SnowBody, SnowSolver, SnowSource, TransferName,
    VolumeFrom,
};
