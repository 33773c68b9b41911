//! The sparse grid, and the order of particles in it.
//!
//! Reads where particles are; writes blocks of cells and of nodes, and particles sorted by block and cell.

mod blocks;
mod block_keys;
mod sparse_grid;
mod migration;
mod chunks;
mod arrivals;
mod cells;
mod sort;
mod trade;
mod memory;

pub use blocks::SIDE;
pub(super) use blocks::{
    CELLS, Coordinate, NONE, NodeBlock, REACH, TILE_ROW, block_of, corner, key_and_cell, key_of, node_of,
    shifted, tile_len, within_reach,
};
pub(super) use chunks::Sorted;
pub use memory::grid_bytes;
pub(super) use memory::{allowed_bytes, needed_bytes};
pub(super) use migration::{AROUND, codes, direction};
pub(super) use sort::Sorter;
pub(super) use sparse_grid::{Grid, ROOM};
