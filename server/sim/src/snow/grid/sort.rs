//! Sorted order: particles by block, by cell within the block, by the user's number within the cell.
//!
//! Reads where each particle of a block went; writes blocks, their particles and the starts of
//! their cells. The order depends on where particles are and on nothing else: neither on threads
//! nor on the past. A particle moves by less than a block in a step, so a block takes those of its
//! own that stay and those that come from the 26 around it.

use std::sync::atomic::{AtomicBool, Ordering};

use super::{
    arrivals::{Arrival, arrivals_of},
    block_keys::{find_neighbors, unite},
    blocks::{CELLS, CellStarts, NONE, REACHED, block_of, key_and_cell, key_of, shifted},
    cells::{NOBODY, accumulate, copy_cells, insert, starts_after},
    chunks::{Chunks, Sorted},
    migration::{AROUND, FAR, Migration, STAY, direction},
    sparse_grid::Grid,
};
use crate::{
    math::Real,
    parallel::{Disjoint, Own, between_mut, per_block, per_block_mut},
};

/// What the order becomes.
#[derive(Clone, Debug, Default)]
struct Next {
    order: Vec<u32>,
    starts: Vec<u32>,
    blocks: Vec<u64>,
}

/// The sorted order and what renews it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sorter {
    /// Places of particles, block after block, cell after cell.
    pub(crate) order: Vec<u32>,
    /// Where each block begins in `order`, and the end.
    pub(crate) starts: Vec<u32>,
    /// Where each cell begins within its block, and the end.
    pub(crate) cells: Vec<CellStarts>,
    /// By position in `order`: 64 times the direction a particle went, plus its cell there.
    pub(super) codes: Vec<u16>,
    /// Of each block, how many went in each direction.
    pub(super) leaving: Vec<[u32; AROUND]>,
    /// Of each block, where those of each cell begin that stayed in their cell; they come first.
    pub(super) settled: Vec<CellStarts>,
    next: Next,
    /// Blocks that particles went to from others.
    entered: Vec<u64>,
    /// For each new block, the old blocks around it.
    sources: Vec<[u32; AROUND]>,
    /// What one thread works on at a time.
    pub(crate) chunks: Chunks,
    /// Particles that changed their block since the places were renewed.
    pub(crate) moved: usize,
    /// Whether a particle went too far, or is nowhere.
    scattered: bool,
    /// Particles of other ranks that come.
    pub(super) arrivals: Vec<Arrival>,
    /// Blocks that particles go to, with the block and the direction from which they go, while they are handed over.
    pub(super) gone: Vec<(u64, usize, usize)>,
    /// Whether blocks are others than before the last sort.
    pub(crate) has_changed: bool,
}

impl Sorter {
    /// The order, to be read.
    pub(crate) fn sorted(&self) -> Sorted<'_> {
        let Self { order, starts, cells, chunks, .. } = self;
        Sorted { order, starts, cells, chunks }
    }

    /// The order, to be read while it is noted where particles go.
    pub(crate) fn migrate(&mut self) -> (Sorted<'_>, Migration<'_>) {
        let Self { order, starts, cells, chunks, codes, .. } = self;
        (Sorted { order, starts, cells, chunks }, Migration { codes: Disjoint::new(codes) })
    }

    /// Room for more blocks than there are.
    pub(crate) fn reserve(&mut self, blocks: usize) {
        self.starts.reserve(blocks);
        self.chunks.reserve(blocks);
        self.next.starts.reserve(blocks);
        self.cells.reserve(blocks);
        self.leaving.reserve(blocks);
        self.settled.reserve(blocks);
        self.sources.reserve(blocks);
        self.next.blocks.reserve(blocks);
        // Every block may send to several before they are counted once.
        self.entered.reserve(8 * blocks);
    }

    /// Room for so many particles, as come from other ranks at most.
    pub(crate) fn reserve_places(&mut self, count: usize) {
        self.order.reserve(count);
        self.next.order.reserve(count);
        self.codes.reserve(count);
    }

    /// Bytes in use.
    pub(crate) fn bytes(&self) -> usize {
        (self.order.capacity() + self.next.order.capacity() + self.starts.capacity()) * 4
            + self.chunks.bytes()
            + self.cells.capacity() * size_of::<CellStarts>()
            + self.codes.capacity() * 2
            + self.settled.capacity() * size_of::<CellStarts>()
            + (self.leaving.capacity() + self.sources.capacity()) * 4 * AROUND
            + (self.next.blocks.capacity() + self.entered.capacity()) * 8
    }

    /// Sorts from nothing: `nodes` are the places of particles, with the first node of each.
    pub(crate) fn rebuild<R: Real>(
        &mut self,
        nodes: impl Iterator<Item = (u32, [i32; 3])>,
        id: &[u32],
        grid: &mut Grid<R>,
        periodic: [u32; 3],
    ) {
        let mut keyed: Vec<(u64, u32, u32, u32)> = nodes
            .map(|(place, node)| {
                let (key, cell) = key_and_cell(node, periodic);
                (key, cell, id[place as usize], place)
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

        self.codes.resize(self.order.len(), 0);
        self.next.order.resize(self.order.len(), 0);
        self.sources.clear();
        self.scattered = false;
        self.has_changed = true;
        self.chunks.divide(&self.starts);
    }

    /// Whether no particle went too far in the step that was begun with, or is nowhere.
    pub(crate) fn has_followed(&self) -> bool {
        !self.scattered
    }

    /// Parts those that stay in their cell from others, after a step whose migration was noted.
    pub(crate) fn begin<R: Real>(&mut self, grid: &Grid<R>, periodic: [u32; 3]) {
        self.part();
        self.arrivals.clear();
        let mut entered = std::mem::take(&mut self.entered);
        entered.clear();
        entered.extend(self.leavers(&grid.blocks, periodic).map(|(key, ..)| key));
        self.scattered |= entered.iter().any(|key| !is_reached(*key));
        self.entered = entered;
    }

    /// Blocks that particles go to, with the block and the direction from which they go.
    pub(super) fn leavers<'a>(
        &'a self,
        blocks: &'a [u64],
        periodic: [u32; 3],
    ) -> impl Iterator<Item = (u64, usize, usize)> + 'a {
        blocks.iter().zip(&self.leaving).enumerate().flat_map(move |(block, (key, leaving))| {
            let goes = |i: &usize| *i != STAY && leaving[*i] > 0;
            (0..AROUND)
                .filter(goes)
                .map(move |i| (key_of(shifted(block_of(*key), direction(i), periodic)), block, i))
        })
    }

    /// Sorts after a step that was begun, those taken in included.
    pub(crate) fn renew<R: Real>(&mut self, id: &[u32], grid: &mut Grid<R>, periodic: [u32; 3]) {
        self.arrivals.sort_unstable();
        self.find_blocks(grid);

        let same = self.next.blocks == grid.blocks;
        if !same || self.sources.len() != self.next.blocks.len() {
            self.find_sources(&grid.blocks, periodic);
        }

        self.count();
        self.fill(id);

        std::mem::swap(&mut self.order, &mut self.next.order);
        std::mem::swap(&mut self.starts, &mut self.next.starts);
        self.chunks.divide(&self.starts);
        self.codes.resize(self.order.len(), 0);
        if !same {
            std::mem::swap(&mut grid.blocks, &mut self.next.blocks);
            self.sources.clear();
        }
        self.has_changed = !same;
    }

    /// Puts those that stay in their cell first in each block, in their order, and counts who goes
    /// where.
    fn part(&mut self) {
        let Self { order, starts, cells, codes, leaving, settled, .. } = self;
        let blocks = Own::whole(starts.len() - 1, 1);
        leaving.resize(starts.len() - 1, [0; AROUND]);
        settled.resize(starts.len() - 1, [0; CELLS + 1]);

        let lost = AtomicBool::new(false);
        let places = (between_mut(order, starts), between_mut(codes, starts));
        let fields = (places, per_block_mut(leaving), per_block_mut(settled), per_block(cells));
        blocks.each(fields, |_, ((order, codes), leaving, settled, cells)| {
            *leaving = [0; AROUND];
            let mut kept = 0;
            for cell in 0..CELLS {
                let own = (STAY * CELLS + cell) as u16;
                for at in cells[cell] as usize..cells[cell + 1] as usize {
                    let code = codes[at];
                    if code == own {
                        if kept < at {
                            order.swap(kept, at);
                            codes[at] = codes[kept];
                        }
                        kept += 1;
                    } else if code == FAR {
                        lost.store(true, Ordering::Relaxed);
                    } else {
                        leaving[usize::from(code) / CELLS] += 1;
                    }
                }
                settled[cell + 1] = kept as u32;
            }
            leaving[STAY] += settled[CELLS];
        });

        self.scattered = lost.into_inner();
        let stayed = self.leaving.iter().map(|counts| counts[STAY]).sum::<u32>();
        self.moved += self.order.len() - stayed as usize;
    }

    /// Blocks that have particles now, sorted.
    fn find_blocks<R: Real>(&mut self, grid: &Grid<R>) {
        let Self { leaving, entered, next, arrivals, .. } = self;
        entered.retain(|key| grid.own_keys.contains(key));
        entered.extend(arrivals.iter().map(|(key, ..)| *key));
        entered.sort_unstable();
        entered.dedup();
        let old = || grid.blocks.iter().zip(&*leaving);
        let kept = old().filter(|(_, leaving)| leaving[STAY] > 0).map(|(key, _)| *key);
        unite(kept, entered.iter().copied(), &mut next.blocks);
    }

    /// The old blocks around each new one: source i went in direction i to come here.
    fn find_sources(&mut self, blocks: &[u64], periodic: [u32; 3]) {
        let Self { sources, next, .. } = self;
        sources.resize(next.blocks.len(), [NONE; AROUND]);
        find_neighbors(&next.blocks, blocks, sources, |i| direction(AROUND - 1 - i), periodic);
    }

    /// Starts of the new blocks.
    fn count(&mut self) {
        let Self { sources, leaving, next, arrivals, .. } = self;
        next.starts.clear();

        // The last stays 0 and becomes the end.
        next.starts.resize(sources.len() + 1, 0);
        let fields = (per_block_mut(&mut next.starts), per_block(sources));
        Own::whole(sources.len(), 1).each(fields, |_, (count, sources)| {
            *count = (sources.iter().enumerate().filter(|(_, from)| **from != NONE))
                .map(|(i, from)| leaving[*from as usize][i])
                .sum();
        });
        for arrivals in arrivals.chunk_by(|a, b| a.0 == b.0) {
            let block = next.blocks.binary_search(&arrivals[0].0).expect("blocks that are entered are found");
            next.starts[block] += arrivals.len() as u32;
        }

        let mut total = 0;
        for start in &mut next.starts {
            (*start, total) = (total, total + *start);
        }
        next.order.resize(total as usize, 0);
    }

    /// Takes the particles of each new block, by cell and number.
    fn fill(&mut self, id: &[u32]) {
        let Self { order, starts, codes, leaving, settled, sources, next, cells, arrivals, .. } = self;
        let (arrivals, next_blocks) = (&arrivals[..], &next.blocks[..]);
        cells.resize(sources.len(), [0; CELLS + 1]);

        let (order, codes) = (order.as_slice(), codes.as_slice());
        let fields = (between_mut(&mut next.order, &next.starts), per_block_mut(cells), per_block(sources));
        Own::whole(sources.len(), 1).each(fields, |block, (out, cells, sources)| {
            let arrivals = arrivals_of(arrivals, next_blocks[block]);
            // Where to look for those that changed their cell, and which direction they went.
            let (mut ranges, mut count) = (std::array::from_fn::<_, AROUND, _>(|i| (0..0_usize, i)), 0);
            for i in (0..AROUND).filter(|i| sources[*i] != NONE) {
                let from = sources[i] as usize;
                let kept = settled[from][CELLS];
                if leaving[from][i] > if i == STAY { kept } else { 0 } {
                    let (start, end) = (starts[from] as usize, starts[from + 1] as usize);
                    ranges[count] = (start + kept as usize..end, i);
                    count += 1;
                }
            }

            let ranges = &ranges[..count];
            let (kept, from) = match sources[STAY] {
                NONE => (&NOBODY, 0),
                own => (&settled[own as usize], starts[own as usize] as usize),
            };

            *cells = *kept;
            if !ranges.is_empty() || !arrivals.is_empty() {
                starts_after(cells, ranges, codes, arrivals);
            }

            let mut filled = [0; CELLS];
            copy_cells(out, cells, &order[from..], kept, &mut filled);
            for (range, direction) in ranges {
                for (code, place) in codes[range.clone()].iter().zip(&order[range.clone()]) {
                    if usize::from(*code) / CELLS == *direction {
                        let cell = usize::from(*code) % CELLS;
                        let start = cells[cell] as usize;
                        insert(&mut out[start..=start + filled[cell]], *place, id);
                        filled[cell] += 1;
                    }
                }
            }
            for (_, cell, place) in arrivals {
                let cell = usize::from(*cell);
                let start = cells[cell] as usize;
                insert(&mut out[start..=start + filled[cell]], *place, id);
                filled[cell] += 1;
            }
        });
    }
}

/// Whether a block may hold particles.
fn is_reached(key: u64) -> bool {
    block_of(key).iter().all(|c| REACHED.contains(c))
}

impl Sorter {
    /// The order after particles were put in it: every place is its own.
    pub(crate) fn renumber(&mut self, id: &mut [u32], object: &mut [u16]) {
        let Self { order, next, codes, moved, .. } = self;
        let all = Own::whole(order.len(), 1);
        let fields = (per_block_mut(&mut next.order), per_block(order));
        all.each(fields, |_, (number, place)| *number = id[*place as usize]);
        id.copy_from_slice(&next.order);
        let fields = (per_block_mut(codes), per_block(order));
        all.each(fields, |_, (code, place)| *code = object[*place as usize]);
        object.copy_from_slice(codes);
        all.each(per_block_mut(order), |i, place| *place = i as u32);
        *moved = 0;
    }
}
