//! Sorted order: particles by block, by cell within the block, by the user's number within the cell.
//!
//! Reads where each particle of a block went; writes blocks, their particles and the starts of
//! their cells. The order depends on where particles are and on nothing else: neither on threads
//! nor on the past. A particle moves by less than a block in a step, so a block takes those of its
//! own that stay and those that come from the 26 around it.

use rayon::prelude::*;

use super::{
    grid::{CELLS, Coordinate, Grid, NONE, REACH, SIDE, block_of, key_of, shifted, wrap},
    grid_to_particles::CellStarts,
};
use crate::{math::Real, parallel::Disjoint};

/// Directions to the blocks around a block, itself in the middle.
const AROUND: usize = 27;
/// The direction of those that stay.
const STAY: usize = 13;
/// Went further than to a block around.
const FAR: u16 = u16::MAX;

/// A step of -1, 0, 1 along each axis.
fn direction(i: usize) -> [i32; 3] {
    [(i / 9) as i32 - 1, (i / 3 % 3) as i32 - 1, (i % 3) as i32 - 1]
}

/// The sorted order and what renews it.
#[derive(Clone, Debug, Default)]
pub(super) struct Sorter {
    /// Places of particles, block after block, cell after cell.
    pub(super) order: Vec<u32>,
    /// Where each block begins in `order`, and the end.
    pub(super) starts: Vec<u32>,
    /// Where each cell begins within its block, and the end.
    pub(super) cells: Vec<CellStarts>,
    /// By position in `order`: 64 times the direction a particle went, plus its cell there.
    codes: Vec<u16>,
    /// Of each block, how many went in each direction.
    leaving: Vec<[u32; AROUND]>,
    next_order: Vec<u32>,
    next_starts: Vec<u32>,
    next_blocks: Vec<u64>,
    /// For each new block, the old blocks around it.
    sources: Vec<[u32; AROUND]>,
    /// Particles that changed their block since the places were renewed.
    pub(super) moved: usize,
    /// Whether a particle went too far, or is nowhere.
    scattered: bool,
}

/// Code of a particle of `block` whose first node is now `node`.
fn code(block: Coordinate, node: [i32; 3], periodic: [u32; 3]) -> u16 {
    let (mut direction, mut cell) = (0, 0);
    for axis in 0..3 {
        let period = periodic[axis] as i32;
        let mut by = wrap(node[axis].div_euclid(SIDE as i32), periodic[axis]) - block[axis];
        if period > 0 {
            by = by.rem_euclid(period);
            by = if 2 * by > period { by - period } else { by };
        }
        if !(-1..=1).contains(&by) {
            return FAR;
        }
        direction = 3 * direction + (by + 1) as u16;
        cell = SIDE as u16 * cell + node[axis].rem_euclid(SIDE as i32) as u16;
    }
    direction * CELLS as u16 + cell
}

/// Writes where the particles of a block went.
pub(super) struct Departures<'a> {
    codes: Disjoint<'a, u16>,
    periodic: [u32; 3],
}

impl Departures<'_> {
    /// The particle at a position of the order, of `block`, now begins at `node`.
    #[inline(always)]
    #[allow(unsafe_code, reason = "blocks have ranges of their own in the order")]
    pub(super) fn note(&self, position: usize, block: Coordinate, node: [f64; 3]) {
        let code = code(block, node.map(|c| c as i32), self.periodic);
        // SAFETY: a position belongs to one block, and a block is worked on by one thread.
        unsafe { *self.codes.slot(position) = code };
    }
}

impl Sorter {
    /// Order, starts of blocks and of cells, to be read while departures are noted.
    pub(super) fn depart(&mut self, periodic: [u32; 3]) -> (&[u32], &[u32], &[CellStarts], Departures<'_>) {
        let Self { order, starts, cells, codes, .. } = self;
        (order, starts, cells, Departures { codes: Disjoint::new(codes), periodic })
    }

    /// Room for more blocks than there are.
    pub(super) fn reserve(&mut self, blocks: usize) {
        self.starts.reserve(blocks);
        self.next_starts.reserve(blocks);
        self.cells.reserve(blocks);
        self.leaving.reserve(blocks);
        self.sources.reserve(blocks);
        // Every block may send to several before they are counted once.
        self.next_blocks.reserve(8 * blocks);
    }

    /// Bytes in use.
    pub(super) fn bytes(&self) -> usize {
        (self.order.capacity() + self.next_order.capacity() + self.starts.capacity()) * 4
            + self.cells.capacity() * size_of::<CellStarts>()
            + self.codes.capacity() * 2
            + (self.leaving.capacity() + self.sources.capacity()) * 4 * AROUND
            + self.next_blocks.capacity() * 8
    }

    /// Sorts from nothing: `nodes` holds the first node of the particle at each place.
    pub(super) fn rebuild<R: Real>(
        &mut self,
        nodes: &[[i32; 3]],
        id: &[u32],
        grid: &mut Grid<R>,
        periodic: [u32; 3],
    ) {
        let mut keyed: Vec<(u64, u32, u32, u32)> = (nodes.iter().zip(id).enumerate())
            .map(|(place, (node, id))| {
                let block = [0, 1, 2].map(|a| wrap(node[a].div_euclid(SIDE as i32), periodic[a]));
                let cell =
                    node.iter().fold(0, |cell, n| SIDE as u32 * cell + n.rem_euclid(SIDE as i32) as u32);
                (key_of(block), cell, *id, place as u32)
            })
            .collect();
        keyed.sort_unstable();
        grid.blocks.clear();
        self.cells.clear();
        self.starts.clear();
        self.order.clear();
        for (i, (key, cell, _, place)) in keyed.into_iter().enumerate() {
            if grid.blocks.last() != Some(&key) {
                grid.blocks.push(key);
                self.starts.push(i as u32);
                self.cells.push([0; CELLS + 1]);
            }
            let counts = self.cells.last_mut().expect("a block was pushed");
            counts[cell as usize + 1] += 1;
            self.order.push(place);
        }
        self.order.shrink_to_fit();
        self.starts.push(self.order.len() as u32);
        self.cells.iter_mut().for_each(accumulate);
        self.codes.resize(nodes.len(), 0);
        self.next_order.resize(nodes.len(), 0);
        self.sources.clear();
        self.scattered = false;
        grid.link(periodic);
    }

    /// Sorts after a step, from the departures that were noted; false where a particle went too
    /// far for that, and nothing was changed.
    pub(super) fn renew<R: Real>(&mut self, id: &[u32], grid: &mut Grid<R>, periodic: [u32; 3]) -> bool {
        self.part();
        if self.scattered {
            return false;
        }
        self.find_blocks(&grid.blocks, periodic);
        let same = self.next_blocks == grid.blocks;
        if !same || self.sources.len() != self.next_blocks.len() {
            self.find_sources(&grid.blocks, periodic);
        }
        self.count();
        self.fill(id);
        std::mem::swap(&mut self.order, &mut self.next_order);
        std::mem::swap(&mut self.starts, &mut self.next_starts);
        if !same {
            std::mem::swap(&mut grid.blocks, &mut self.next_blocks);
            self.sources.clear();
            grid.link(periodic);
        }
        true
    }

    /// Puts those that stay first in each block, and counts who goes where.
    fn part(&mut self) {
        let Self { order, starts, codes, leaving, .. } = self;
        leaving.resize(starts.len() - 1, [0; AROUND]);
        let (order, codes) = (Disjoint::new(order), Disjoint::new(codes));
        let lost = leaving.par_iter_mut().enumerate().map(|(block, leaving)| {
            *leaving = [0; AROUND];
            let (mut stayed, mut lost) = (starts[block] as usize, false);
            for at in starts[block] as usize..starts[block + 1] as usize {
                let code = *at_of(&codes, at);
                if code == FAR {
                    lost = true;
                    continue;
                }
                let direction = usize::from(code) / CELLS;
                leaving[direction] += 1;
                if direction == STAY {
                    if stayed < at {
                        std::mem::swap(at_of(&order, stayed), at_of(&order, at));
                        std::mem::swap(at_of(&codes, stayed), at_of(&codes, at));
                    }
                    stayed += 1;
                }
            }
            lost
        });
        self.scattered = lost.filter(|lost| *lost).count() > 0;
        let moved = self.leaving.iter().map(|counts| counts.iter().sum::<u32>() - counts[STAY]).sum::<u32>();
        self.moved += moved as usize;
    }

    /// Blocks that have particles now, sorted.
    fn find_blocks(&mut self, blocks: &[u64], periodic: [u32; 3]) {
        self.next_blocks.clear();
        for (&key, leaving) in blocks.iter().zip(&self.leaving) {
            let block = block_of(key);
            for (i, _) in leaving.iter().enumerate().filter(|(_, count)| **count > 0) {
                self.next_blocks.push(key_of(shifted(block, direction(i), periodic)));
            }
        }
        self.next_blocks.sort_unstable();
        self.next_blocks.dedup();
    }

    /// The old blocks around each new one: source i went in direction i to come here.
    fn find_sources(&mut self, blocks: &[u64], periodic: [u32; 3]) {
        let Self { sources, next_blocks, .. } = self;
        sources.resize(next_blocks.len(), [NONE; AROUND]);
        sources.par_iter_mut().zip(next_blocks).for_each(|(sources, key)| {
            let block = block_of(*key);
            for i in 0..AROUND {
                let from = key_of(shifted(block, direction(AROUND - 1 - i), periodic));
                sources[i] = blocks.binary_search(&from).map_or(NONE, |index| index as u32);
            }
        });
    }

    /// Starts of the new blocks.
    fn count(&mut self) {
        let Self { sources, leaving, next_starts, .. } = self;
        next_starts.clear();
        let mut total = 0;
        for sources in sources.iter() {
            next_starts.push(total);
            total += (0..AROUND)
                .filter(|i| sources[*i] != NONE)
                .map(|i| leaving[sources[i] as usize][i])
                .sum::<u32>();
        }
        next_starts.push(total);
    }

    /// Takes the particles of each new block, by cell and number.
    fn fill(&mut self, id: &[u32]) {
        let Self { order, starts, codes, leaving, sources, next_starts, next_order, cells, .. } = self;
        cells.resize(sources.len(), [0; CELLS + 1]);
        let out = Disjoint::new(next_order);
        let (order, codes) = (order.as_slice(), codes.as_slice());
        cells.par_iter_mut().zip(&*sources).enumerate().for_each(|(block, (cells, sources))| {
            // Where to look, and which direction they went: those that stay, then those that come.
            let (mut ranges, mut count) = (std::array::from_fn::<_, AROUND, _>(|i| (0..0_usize, i)), 0);
            for i in (0..AROUND).filter(|i| sources[*i] != NONE) {
                let from = sources[i] as usize;
                if leaving[from][i] > 0 {
                    let (start, end) = (starts[from] as usize, starts[from + 1] as usize);
                    let stayed = start + leaving[from][STAY] as usize;
                    ranges[count] = (if i == STAY { start..stayed } else { stayed..end }, i);
                    count += 1;
                }
            }
            *cells = [0; CELLS + 1];
            for (range, direction) in &ranges[..count] {
                for code in &codes[range.clone()] {
                    if usize::from(*code) / CELLS == *direction {
                        cells[usize::from(*code) % CELLS + 1] += 1;
                    }
                }
            }
            accumulate(cells);
            let first = next_starts[block] as usize;
            let mut filled = [0; CELLS];
            for (range, direction) in &ranges[..count] {
                for (code, place) in codes[range.clone()].iter().zip(&order[range.clone()]) {
                    if usize::from(*code) / CELLS == *direction {
                        let cell = usize::from(*code) % CELLS;
                        let start = first + cells[cell] as usize;
                        insert(&out, start, start + filled[cell], *place, id);
                        filled[cell] += 1;
                    }
                }
            }
        });
    }
}

/// Inserts a place by the user's number into `start..end`, which is sorted.
#[inline(always)]
fn insert(out: &Disjoint<'_, u32>, start: usize, end: usize, place: u32, id: &[u32]) {
    let mut at = end;
    while at > start && id[*at_of(out, at - 1) as usize] > id[place as usize] {
        *at_of(out, at) = *at_of(out, at - 1);
        at -= 1;
    }
    *at_of(out, at) = place;
}

/// An element of the order, within the range of the block at work.
#[inline(always)]
#[allow(unsafe_code, clippy::mut_from_ref, reason = "ranges of blocks do not meet")]
fn at_of<'a, T>(order: &'a Disjoint<'_, T>, at: usize) -> &'a mut T {
    // SAFETY: blocks have ranges of their own in the order, and a block is worked on by one thread.
    unsafe { order.slot(at) }
}

/// Counts to starts.
fn accumulate(cells: &mut CellStarts) {
    for cell in 0..CELLS {
        cells[cell + 1] += cells[cell];
    }
}

/// Whether a first node is within the range of keys.
pub(super) fn within_reach(node: f64) -> bool {
    node.abs() < f64::from((REACH - 2) * SIDE as i32)
}

impl Sorter {
    /// The order after particles were put in it: every place is its own.
    pub(super) fn renumber(&mut self, id: &mut [u32], object: &mut [u16]) {
        let Self { order, next_order, codes, moved, .. } = self;
        next_order.par_iter_mut().zip(&*order).for_each(|(number, place)| *number = id[*place as usize]);
        id.copy_from_slice(next_order);
        codes.par_iter_mut().zip(&*order).for_each(|(code, place)| *code = object[*place as usize]);
        object.copy_from_slice(codes);
        order.par_iter_mut().enumerate().for_each(|(i, place)| *place = i as u32);
        *moved = 0;
    }
}
