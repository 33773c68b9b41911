//! The sparse grid, and the order of particles in it.
//!
//! Reads where particles are; writes blocks of cells and of nodes, and particles sorted by block and cell.

mod blocks;
mod block_keys;
mod sparse_grid;
mod migration;
mod chunks;
mod sort;
mod memory;

pub use blocks::SIDE;
pub(super) use blocks::{
    CELLS, Coordinate, NONE, NodeBlock, REACH, TILE_ROW, block_of, corner, node_of, tile_len, within_reach,
};
pub(super) use chunks::Sorted;
pub use memory::grid_bytes;
pub(super) use memory::{allowed_bytes, needed_bytes};
pub(super) use migration::codes;
pub(super) use sort::Sorter;
pub(super) use sparse_grid::{Grid, ROOM};
