//! Runs of blocks: what one thread works on at a time, cut from the sorted order alone.
//!
//! Reads the order; writes where runs begin. A run holds particles enough to fill lanes, even
//! where snow is so thin that a block holds but a few.

use std::ops::Range;

use super::{blocks::CellStarts, migration::Departures, sort::Sorter};
use crate::parallel::Disjoint;

/// The sorted order, to be read: places, where blocks begin, where cells begin within, runs.
#[derive(Clone, Copy)]
pub(crate) struct Sorted<'a> {
    pub(crate) order: &'a [u32],
    pub(crate) starts: &'a [u32],
    pub(crate) cells: &'a [CellStarts],
    runs: &'a [u32],
}

impl<'a> Sorted<'a> {
    pub(crate) fn run_count(&self) -> usize {
        self.runs.len() - 1
    }

    /// First block of a run, where it begins in the order, and its places.
    pub(crate) fn run(&self, run: usize) -> (usize, usize, &'a [u32]) {
        let [block, end] = [self.runs[run], self.runs[run + 1]].map(|block| block as usize);
        let first = self.starts[block] as usize;
        (block, first, &self.order[first..self.starts[end] as usize])
    }
}

/// Particles of a run, of a snow of many.
const RUN: usize = 1024;

impl Sorter {
    /// The order, to be read while departures are noted.
    pub(crate) fn depart(&mut self) -> (Sorted<'_>, Departures<'_>) {
        let Self { order, starts, cells, runs, codes, .. } = self;
        (Sorted { order, starts, cells, runs }, Departures { codes: Disjoint::new(codes) })
    }

    /// Blocks of a run.
    pub(crate) fn blocks_of(&self, run: usize) -> Range<usize> {
        self.runs[run] as usize..self.runs[run + 1] as usize
    }

    /// The order, to be read.
    pub(crate) fn sorted(&self) -> Sorted<'_> {
        let Self { order, starts, cells, runs, .. } = self;
        Sorted { order, starts, cells, runs }
    }

    /// Divides blocks into runs of about as many particles: enough to fill lanes, few enough to
    /// share among threads.
    pub(crate) fn divide(&mut self) {
        let Self { starts, runs, .. } = self;
        let grain = (starts[starts.len() - 1] as usize / 256).clamp(64, RUN) as u32;
        runs.clear();
        let mut next = 0;
        for (block, &start) in starts.iter().enumerate() {
            if start >= next {
                runs.push(block as u32);
                next = start + grain;
            }
        }
        let blocks = starts.len() as u32 - 1;
        if runs.last() != Some(&blocks) {
            runs.push(blocks);
        }
    }
}
