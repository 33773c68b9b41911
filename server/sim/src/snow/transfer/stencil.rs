//! The nodes that each particle reaches, in the sorted order.
//!
//! Reads the order and the grid; keeps the nodes around one block of particles at a time, assembled
//! into a tile, since the particles of a block reach nodes of eight blocks.

use super::scheme::Scheme;
use crate::{
    math::{LANES, Real},
    snow::grid::{Grid, NONE, NodeBlock, SIDE, Sorted, TILE_ROW, block_of, corner},
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

/// The nodes around the block of the last particle asked for; particles are asked for in the sorted order.
pub(crate) struct Stencil<'a, R> {
    sorted: Sorted<'a>,
    grid: StencilNodes<'a, R>,
    /// The block, where it ends in the order, and the cell in it.
    pub(crate) block: usize,
    end: usize,
    cell: usize,
    /// Coordinates of the block.
    place: [R; 3],
}

/// What a stencil reads of the grid, and the tiles of its block.
pub(crate) struct StencilNodes<'a, R> {
    pub(crate) blocks: &'a [u64],
    pub(crate) in_front: &'a [[u32; 8]],
    /// Velocities, and their changes where these are wanted.
    pub(crate) nodes: [&'a [NodeBlock<R>]; 2],
    pub(crate) tiles: &'a mut [[R; TILE]; 2],
}

impl<'a, R: Real> Stencil<'a, R> {
    /// A stencil for the particles from the first of a block on.
    pub(crate) fn new(sorted: Sorted<'a>, grid: StencilNodes<'a, R>, block: usize) -> Self {
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

    /// Coordinates of the block that it is at.
    #[inline(always)]
    pub(crate) fn place(&self) -> &[R; 3] {
        &self.place
    }

    /// The nodes around the block that it is at: velocities, and their changes.
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

impl<'a, R: Real> StencilNodes<'a, R> {
    /// The velocities of a grid and their changes, with room for tiles.
    pub(crate) fn of(grid: &'a Grid<R>, tiles: &'a mut [[R; TILE]; 2]) -> Self {
        Self { blocks: &grid.blocks, in_front: &grid.in_front, nodes: [&grid.nodes, &grid.changes], tiles }
    }
}
