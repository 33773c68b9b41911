//! Chunks of blocks: what one thread works on at a time, cut from the sorted order alone.
//!
//! Reads the order; writes where chunks begin. A chunk holds particles enough to fill lanes, even
//! where snow is so thin that a block holds but a few.

use std::ops::Range;

use super::blocks::CellStarts;
#[cfg(test)]
use crate::parallel::hash_numbers;

/// Particles of a chunk, of a snow of many.
const CHUNK: usize = 1024;

/// Where chunks begin.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chunks {
    /// The first block of each chunk, and the end.
    first_blocks: Vec<u32>,
    /// Of a test that cuts anywhere: what chunks are drawn from.
    #[cfg(test)]
    pub(crate) seed: Option<u64>,
}

impl Chunks {
    /// How many chunks there are.
    pub(crate) fn count(&self) -> usize {
        self.first_blocks.len() - 1
    }

    /// The first block of each chunk, and the end.
    pub(crate) fn starts(&self) -> &[u32] {
        &self.first_blocks
    }

    /// Blocks of a chunk.
    pub(crate) fn blocks(&self, chunk: usize) -> Range<usize> {
        self.first_blocks[chunk] as usize..self.first_blocks[chunk + 1] as usize
    }

    /// Divides blocks into chunks of about as many particles: enough to fill lanes, few enough to
    /// share among threads. `starts` tells where each block begins in the order, and the end.
    pub(crate) fn divide(&mut self, starts: &[u32]) {
        let Self { first_blocks, .. } = self;
        let least = (starts[starts.len() - 1] as usize / 256).clamp(64, CHUNK) as u32;
        first_blocks.clear();
        let mut next = 0;
        for (block, &start) in starts.iter().enumerate() {
            if start >= next {
                first_blocks.push(block as u32);
                next = start + least;
                #[cfg(test)]
                if let Some(seed) = self.seed {
                    next = start + 1 + hash_numbers(seed, [f64::from(start)]) as u32 % (2 * least);
                }
            }
        }

        let blocks = starts.len() as u32 - 1;
        if first_blocks.last() != Some(&blocks) {
            first_blocks.push(blocks);
        }
    }

    /// Room for as many more chunks.
    pub(crate) fn reserve(&mut self, chunks: usize) {
        self.first_blocks.reserve(chunks);
    }

    /// Bytes in use.
    pub(crate) fn bytes(&self) -> usize {
        self.first_blocks.capacity() * 4
    }
}

/// The sorted order, to be read.
#[derive(Clone, Copy)]
pub(crate) struct Sorted<'a> {
    /// Places of particles, block after block, cell after cell.
    pub(crate) order: &'a [u32],
    /// Where each block begins in `order`, and the end.
    pub(crate) starts: &'a [u32],
    /// Where each cell begins within its block, and the end.
    pub(crate) cells: &'a [CellStarts],
    pub(crate) chunks: &'a Chunks,
}

impl<'a> Sorted<'a> {
    /// Places of the particles of a block, cell after cell.
    pub(crate) fn places(&self, block: usize) -> &'a [u32] {
        &self.order[self.starts[block] as usize..self.starts[block + 1] as usize]
    }

    /// First block of a chunk, where it begins in the order, and its places.
    pub(crate) fn chunk(&self, chunk: usize) -> (usize, usize, &'a [u32]) {
        let Range { start: block, end } = self.chunks.blocks(chunk);
        let first = self.starts[block] as usize;
        (block, first, &self.order[first..self.starts[end] as usize])
    }
}
