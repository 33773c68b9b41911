//! Memory that a grid needs, known from its blocks before anything is stored on them.
//!
//! Reads numbers of blocks; gives bytes. Each particle that flies alone takes a block and the eight blocks of nodes
//! around it, some 17 kB in binary32: snow that flies apart has a bound.

use super::{
    blocks::{CellStarts, NodeBlock, tile_len},
    migration::AROUND,
    sparse_grid::ROOM,
};
use crate::{
    math::{Precision, Real},
    snow::settings::{Forces, SnowSettings},
};

/// Bytes that the grid may take for each particle.
const BYTES_PER_PARTICLE: u64 = 2000;
/// Bytes that every grid may take, however few the particles.
const LEAST_BYTES: u64 = 16 << 20;

/// Lists of a block with particles: its cells twice, who leaves it and from where they come, its links and keys.
const BLOCK_BYTES: usize = 2 * size_of::<CellStarts>() + 8 * AROUND + 128;
/// Lists of a block of nodes: its links and keys.
const NODE_BLOCK_BYTES: usize = 56;
/// Numbers per node, in those of a node: where velocities are solved for, vectors of the solver.
const SOLVED: usize = 10;

/// What is stored on a grid.
#[derive(Clone, Copy, Debug)]
struct Contents {
    /// Nodes that a kernel reaches along an axis.
    width: usize,
    forces: Forces,
    /// Whether a linear system is solved for velocities.
    solved: bool,
}

impl Contents {
    fn of(settings: &SnowSettings) -> Self {
        Self {
            width: settings.kernel.width(),
            forces: settings.transfer.forces(),
            solved: settings.integration.is_implicit(),
        }
    }
}

/// Bytes that the grid of snow needs for so many blocks with particles, and blocks of nodes.
pub fn grid_bytes(settings: &SnowSettings, precision: Precision, blocks: [usize; 2]) -> u64 {
    match precision {
        Precision::F32 => needed_bytes::<f32>(settings, blocks),
        Precision::F64 => needed_bytes::<f64>(settings, blocks),
    }
}

/// Bytes that the grid of so many particles may take.
pub(crate) fn allowed_bytes(particles: usize) -> u64 {
    (particles as u64).saturating_mul(BYTES_PER_PARTICLE).max(LEAST_BYTES)
}

/// Bytes that the order and the grid need for so many blocks, with the room of vectors that grow.
pub(crate) fn needed_bytes<R: Real>(settings: &SnowSettings, [blocks, node_blocks]: [usize; 2]) -> u64 {
    let contents = Contents::of(settings);
    let copies = if contents.forces == Forces::Apart { 2 } else { 1 };
    let solved = if contents.solved { SOLVED } else { 0 };
    let [tile, node] = [tile_len(contents.width) * size_of::<R>(), size_of::<NodeBlock<R>>()];
    let [tile, node] = [tile * (copies + solved.min(1)), node * (copies + solved)];

    let lists = 2 * (blocks * BLOCK_BYTES + node_blocks * NODE_BLOCK_BYTES);
    let with_room = |blocks: usize| blocks + blocks / 8 + ROOM;
    (lists + with_room(blocks) * tile + with_room(node_blocks) * node) as u64
}
