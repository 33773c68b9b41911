//! A walk through particles in the sorted order, with the nodes that each of them reaches.
//!
//! Reads the order and the grid; keeps the nodes around one block of particles at a time, assembled
//! into a tile, since the particles of a block reach nodes of eight blocks.

use super::scheme::Scheme;
use crate::math::{LANES, Real};
use crate::snow::grid::{
    blocks::{Grid, NONE, NodeBlock, SIDE, TILE_ROW, block_of, corner},
    chunks::Sorted,
};

/// The largest tile: seven rows each way.
pub(crate) const TILE: usize = 7 * 7 * TILE_ROW;

/// Assembles the nodes that a block's particles reach with a kernel of width `N`.
#[inline(always)]
fn assemble<R: Real, const N: usize>(nodes: &[NodeBlock<R>], in_front: &[u32; 8], tile: &mut [R; TILE]) {
    let width = SIDE + N - 1;
    for (i, &index) in in_front.iter().enumerate() {
        debug_assert!(index != NONE);
        let [ox, oy, oz] = corner(i).map(|c| c as usize * SIDE);
        let block = nodes[index as usize].as_flattened();
        for x in 0..SIDE.min(width - ox) {
            for y in 0..SIDE.min(width - oy) {
                let from = (x * SIDE + y) * LANES;
                let to = ((ox + x) * width + oy + y) * TILE_ROW + 4 * oz;
                tile[to..to + LANES].copy_from_slice(&block[from..from + LANES]);
            }
        }
    }
}

/// A walk through particles in the sorted order, with the nodes around the block that it is in.
pub(crate) struct Walk<'a, R> {
    sorted: Sorted<'a>,
    grid: Around<'a, R>,
    /// The block, where it ends in the order, and the cell in it.
    pub(crate) block: usize,
    end: usize,
    cell: usize,
    /// Coordinates of the block.
    place: [R; 3],
}

/// What a walk reads of the grid, and the tiles of the block that it is in.
pub(crate) struct Around<'a, R> {
    pub(crate) blocks: &'a [u64],
    pub(crate) in_front: &'a [[u32; 8]],
    /// Velocities, and their changes where these are wanted.
    pub(crate) nodes: [&'a [NodeBlock<R>]; 2],
    pub(crate) tiles: &'a mut [[R; TILE]; 2],
}

impl<'a, R: Real> Walk<'a, R> {
    /// A walk from the first particle of a block on.
    pub(crate) fn new(sorted: Sorted<'a>, grid: Around<'a, R>, block: usize) -> Self {
        // Before the block, so that the first particle enters it.
        Self { sorted, grid, block, end: 0, cell: 0, place: [R::zero(); 3] }
    }

    /// Cell of the particle at a position of the order, which is not before the last one asked for.
    #[inline(always)]
    pub(crate) fn cell_of<S: Scheme, const N: usize>(&mut self, position: usize) -> usize {
        if position >= self.end {
            self.enter::<S, N>(position);
        }
        let first = self.sorted.starts[self.block] as usize;
        let cells = &self.sorted.cells[self.block];
        while cells[self.cell + 1] as usize <= position - first {
            self.cell += 1;
        }
        self.cell
    }

    /// Coordinates of the block that it is in.
    #[inline(always)]
    pub(crate) fn place(&self) -> &[R; 3] {
        &self.place
    }

    /// The nodes around the block that it is in: velocities, and their changes.
    #[inline(always)]
    pub(crate) fn tiles(&self) -> &[[R; TILE]; 2] {
        self.grid.tiles
    }

    /// Goes to the block of the particle at a position; every block holds a particle.
    #[inline(never)]
    fn enter<S: Scheme, const N: usize>(&mut self, position: usize) {
        if self.end > 0 {
            self.block += 1;
        }
        self.end = self.sorted.starts[self.block + 1] as usize;
        debug_assert!(position < self.end);
        self.cell = 0;
        let grid = &mut self.grid;
        self.place = block_of(grid.blocks[self.block]).map(|c| R::of(f64::from(c)));
        let in_front = &grid.in_front[self.block];
        assemble::<R, N>(grid.nodes[0], in_front, &mut grid.tiles[0]);
        if S::APART {
            assemble::<R, N>(grid.nodes[1], in_front, &mut grid.tiles[1]);
        }
    }
}

impl<R: Real> Grid<R> {
    /// What a walk reads, with room for its tiles.
    pub(crate) fn around<'a>(&'a self, tiles: &'a mut [[R; TILE]; 2]) -> Around<'a, R> {
        Around { blocks: &self.blocks, in_front: &self.in_front, nodes: [&self.nodes, &self.changes], tiles }
    }
}
