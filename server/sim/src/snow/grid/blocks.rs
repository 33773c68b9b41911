//! Blocks of 4 x 4 x 4 cells, and the keys that they are sorted by.
//!
//! A particle belongs to the cell of its first node, so its nodes lie in its own block and in those
//! one further along each axis: eight blocks. Negative coordinates are ordinary.

use std::ops::Range;

/// Cells and nodes along the side of a block.
pub const SIDE: usize = 4;
/// Cells and nodes of a block.
pub(crate) const CELLS: usize = SIDE * SIDE * SIDE;
/// The index of a block that is not there.
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

/// The block that a key belongs to.
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

/// Index of node `i` of a block.
pub(crate) fn node_of(block: Coordinate, i: usize) -> [i32; 3] {
    let local = [i / (SIDE * SIDE), i / SIDE % SIDE, i % SIDE];
    [0, 1, 2].map(|a| block[a] * SIDE as i32 + local[a] as i32)
}

/// Blocks that may hold particles: the blocks around them have keys, and a particle within REACH - 2
/// blocks of the origin has its first node in one of them.
pub(crate) const REACHED: Range<i32> = 1 - REACH..REACH - 2;

/// Whether a first node is in a block that may hold particles.
pub(crate) fn within_reach(node: i32) -> bool {
    REACHED.contains(&node.div_euclid(SIDE as i32))
}

/// The block and the cell there of a particle with this first node.
pub(crate) fn key_and_cell(node: [i32; 3], periodic: [u32; 3]) -> (u64, u32) {
    let block = [0, 1, 2].map(|a| wrap(node[a].div_euclid(SIDE as i32), periodic[a]));
    let cell = node.iter().fold(0, |cell, n| SIDE as u32 * cell + n.rem_euclid(SIDE as i32) as u32);
    (key_of(block), cell)
}
