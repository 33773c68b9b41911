//! The sparse grid: blocks of 4 x 4 x 4 cells that hold particles, and the blocks of nodes around.
//!
//! A particle belongs to the cell of its first node, so its nodes lie in its own block and in those
//! one further along each axis: eight blocks. Blocks are kept sorted by key; nothing else is stored
//! or visited. Negative coordinates are ordinary.

use rayon::prelude::*;

use super::block_keys::{Finder, step_of, unite};
use crate::{math::Real, snow::step::Forces};

/// Cells and nodes along the side of a block.
pub(crate) const SIDE: usize = 4;
/// Cells and nodes of a block.
pub(crate) const CELLS: usize = SIDE * SIDE * SIDE;
/// No block.
pub(crate) const NONE: u32 = u32::MAX;
/// Blocks along an axis on either side of the origin.
pub(crate) const REACH: i32 = 1 << 20;
/// Numbers in a row of a tile: eight nodes along z, four numbers each.
pub(crate) const TILE_ROW: usize = 2 * SIDE * 4;

/// Numbers of the nodes that a block of particles reaches with a kernel of width `n`.
pub(crate) const fn tile_len(n: usize) -> usize {
    (SIDE + n - 1) * (SIDE + n - 1) * TILE_ROW
}

/// Momentum or velocity, and mass, of the nodes of a block: z runs fastest.
pub(crate) type NodeBlock<R> = [[R; 4]; CELLS];

/// Where each cell of a block begins in a list, and the end.
pub(crate) type CellStarts = [u32; CELLS + 1];

/// Where a block is, in blocks.
pub(crate) type Coordinate = [i32; 3];

/// Keys sort as coordinates do.
pub(crate) fn key_of(block: Coordinate) -> u64 {
    block.iter().fold(0, |key, c| (key << 21) | u64::from((c + REACH) as u32 & 0x1F_FFFF))
}

pub(crate) fn block_of(key: u64) -> Coordinate {
    [42, 21, 0].map(|shift| ((key >> shift) & 0x1F_FFFF) as i32 - REACH)
}

/// A block shifted by whole blocks; wrapped along periodic axes.
pub(crate) fn shifted(block: Coordinate, by: [i32; 3], periodic: [u32; 3]) -> Coordinate {
    std::array::from_fn(|a| wrap(block[a] + by[a], periodic[a]))
}

/// A block's coordinate within its period; as it is without one.
pub(crate) fn wrap(coordinate: i32, period: u32) -> i32 {
    if period == 0 { coordinate } else { coordinate.rem_euclid(period as i32) }
}

/// The eight blocks in front of a block, itself first: bits of the number are steps along x, y, z.
pub(crate) const fn corner(i: usize) -> [i32; 3] {
    [(i >> 2) as i32 & 1, (i >> 1) as i32 & 1, i as i32 & 1]
}

/// Blocks, sorted by key.
#[derive(Clone, Debug, Default)]
pub(crate) struct Grid<R> {
    /// Blocks with particles.
    pub(crate) blocks: Vec<u64>,
    /// Blocks with nodes that particles reach.
    pub(crate) node_blocks: Vec<u64>,
    /// For each block with particles, the eight blocks of nodes in front of it.
    pub(crate) in_front: Vec<[u32; 8]>,
    /// For each block of nodes, the eight blocks with particles behind it.
    pub(crate) behind: Vec<[u32; 8]>,
    /// What the particles of each block give to nodes: momentum and mass.
    pub(crate) tiles: Vec<R>,
    /// Impulses of forces alone, where velocities before forces are needed.
    pub(crate) impulses: Vec<R>,
    /// Blocks of nodes, while they are being found.
    spare_blocks: Vec<u64>,
    /// Velocities after forces and colliders, and masses.
    pub(crate) nodes: Vec<NodeBlock<R>>,
    /// Changes of velocity in this step, for FLIP.
    pub(crate) changes: Vec<NodeBlock<R>>,
}

impl<R: Real> Grid<R> {
    /// Finds the blocks of nodes around `self.blocks` and links both.
    pub(crate) fn link(&mut self, periodic: [u32; 3]) {
        self.find_node_blocks(periodic);
        let Self { blocks, node_blocks, in_front, behind, .. } = self;
        in_front.resize(blocks.len(), [NONE; 8]);
        around(blocks, node_blocks, in_front, corner, periodic);
        behind.resize(node_blocks.len(), [NONE; 8]);
        around(node_blocks, blocks, behind, |i| corner(i).map(|c| -c), periodic);
    }

    /// The blocks in front of every block, sorted.
    fn find_node_blocks(&mut self, periodic: [u32; 3]) {
        let Self { blocks, node_blocks, spare_blocks, .. } = self;
        if periodic == [0; 3] {
            // With the next one along z, then along y, then along x: every sum of such steps.
            let next = |blocks: &[u64], by, out: &mut Vec<u64>| {
                let step = step_of(by);
                unite(blocks.iter().copied(), blocks.iter().map(|key| key.wrapping_add(step)), out);
            };
            next(blocks, [0, 0, 1], node_blocks);
            next(node_blocks, [0, 1, 0], spare_blocks);
            next(spare_blocks, [1, 0, 0], node_blocks);
            return;
        }
        node_blocks.clear();
        for &key in blocks.iter() {
            let block = block_of(key);
            node_blocks.extend((0..8).map(|i| key_of(shifted(block, corner(i), periodic))));
        }
        node_blocks.sort_unstable();
        node_blocks.dedup();
    }

    /// Room for the tiles of a kernel of width `n`; never shrinks.
    pub(crate) fn size_for(&mut self, n: usize, separate: Forces) {
        let (blocks, node_blocks, tile) = (self.blocks.len(), self.node_blocks.len(), tile_len(n));
        grow(&mut self.tiles, [blocks, tile], R::zero());
        grow(&mut self.nodes, [node_blocks, 1], [[R::zero(); 4]; CELLS]);
        if separate == Forces::Apart {
            grow(&mut self.impulses, [blocks, tile], R::zero());
            grow(&mut self.changes, [node_blocks, 1], [[R::zero(); 4]; CELLS]);
        }
    }

    /// Room for more blocks than there are, so that a moving front seldom allocates.
    pub(crate) fn reserve(&mut self, blocks: usize) {
        self.blocks.reserve(blocks);
        self.in_front.reserve(blocks);
        self.node_blocks.reserve(8 * blocks);
        self.spare_blocks.reserve(8 * blocks);
        self.behind.reserve(8 * blocks);
    }

    /// Bytes in use.
    pub(crate) fn bytes(&self) -> usize {
        (self.blocks.capacity() + self.node_blocks.capacity() + self.spare_blocks.capacity()) * 8
            + (self.in_front.capacity() + self.behind.capacity()) * 32
            + (self.tiles.capacity() + self.impulses.capacity()) * size_of::<R>()
            + (self.nodes.capacity() + self.changes.capacity()) * size_of::<NodeBlock<R>>()
    }
}

/// Blocks that one thread looks up neighbours for at a time.
const CHUNK: usize = 256;

/// For each block of a list, where in another list the blocks stand that are `by(i)` away.
pub(crate) fn around<const K: usize>(
    blocks: &[u64],
    others: &[u64],
    out: &mut [[u32; K]],
    by: impl Fn(usize) -> [i32; 3] + Sync,
    periodic: [u32; 3],
) {
    out.par_chunks_mut(CHUNK).zip(blocks.par_chunks(CHUNK)).for_each(|(out, blocks)| {
        for i in 0..K {
            let (mut finder, by) = (Finder::new(others), by(i));
            let step = step_of(by);
            for (found, &key) in out.iter_mut().zip(blocks) {
                let wanted = match periodic {
                    [0, 0, 0] => key.wrapping_add(step),
                    _ => key_of(shifted(block_of(key), by, periodic)),
                };
                found[i] = finder.find(wanted);
            }
        }
    });
}

/// Blocks that there is room for on top of those in use: even a few may soon be several times as many.
pub(crate) const ROOM: usize = 64;

/// Makes a field of `blocks` of `each` elements long enough, with some room so that a moving front
/// seldom allocates.
fn grow<T: Copy>(field: &mut Vec<T>, [blocks, each]: [usize; 2], value: T) {
    if field.len() < blocks * each {
        field.resize((blocks + blocks / 8 + ROOM) * each, value);
    }
}
