//! The sparse grid, and the order of particles in it.
//!
//! Reads where particles are; writes blocks of cells and of nodes, and particles sorted by block and cell.

pub(super) mod blocks;
pub(super) mod block_keys;
pub(super) mod migration;
pub(super) mod sort;
pub(super) mod chunks;
