//! What the functions of patches have with those of others: blocks of the matrix below its diagonal.

use super::{
    functions::{WIDTH, width},
    gather::{BlockFunctions, square},
    layout::{MatrixParts, NONE, PatchLayout, TakeParts},
    singles::{Singles, room},
};
use crate::{
    linalg::precondition::Symmetric3,
    math::{LANES, Pack, WithSimd, dispatch},
};

/// Blocks between the patches of a block of rows and those that are eliminated later.
#[derive(Clone, Debug, Default)]
pub(super) struct BlockAcross {
    /// Where those of each patch begin: in the order of [`PatchLayout::later`], by columns, each a function of the patch.
    starts: Vec<usize>,
    entries: Vec<f32>,
}

/// Sums over a block of rows: by functions of its patches, those of others in whole packs.
#[derive(Debug, Default)]
pub(super) struct Sums {
    entries: Vec<f64>,
    /// Where each pair of patches begins, pairs as the layout counts them.
    starts: Vec<usize>,
}

/// How the functions of all patches are found.
#[derive(Clone, Copy)]
pub(super) struct All<'a> {
    pub(super) layout: &'a PatchLayout,
    pub(super) blocks: &'a [BlockFunctions],
}

impl<'a> All<'a> {
    /// Block and number in it of a patch.
    #[inline(always)]
    pub(super) fn find(self, patch: usize) -> (&'a BlockFunctions, usize) {
        let block = self.layout.rows(patch)[0] as usize / self.layout.block_size;
        (&self.blocks[block], patch - self.layout.block_starts[block] as usize)
    }

    /// How many pairs with later patches the patches of a block have, and how many entries sums over them.
    fn needs(self, block: usize) -> [usize; 2] {
        let entries = |patch: usize| {
            let packs = self.layout.later(patch).iter().map(|other| width(self.count(*other as usize)));
            self.count(patch) * packs.sum::<usize>() * LANES
        };
        let patches = self.layout.of_block(block);
        [patches.clone().map(|patch| self.layout.later(patch).len()).sum(), patches.map(entries).sum()]
    }

    /// The most of both that any block needs.
    pub(super) fn most(self) -> [usize; 2] {
        let needs = (0..self.blocks.len()).map(|block| self.needs(block));
        needs.fold([0; 2], |[pairs, entries], needed| [pairs.max(needed[0]), entries.max(needed[1])])
    }

    /// How many functions a patch has.
    #[inline(always)]
    pub(super) fn count(self, patch: usize) -> usize {
        let (block, number) = self.find(patch);
        block.places[number].count
    }

    /// Those of a row, three times as many packs as functions take, and how many there are.
    #[inline(always)]
    fn at(self, patch: usize, row: usize) -> (&'a [Singles], usize) {
        let (block, number) = self.find(patch);
        let count = block.places[number].count;
        let packs = 3 * width(count);
        (&block.of(number, usize::from(self.layout.numbers[row]))[..packs], count)
    }
}

/// Makes the blocks between the patches of a block of rows and others.
pub(super) fn join_others(
    all: All<'_>,
    block: usize,
    source: &dyn MatrixParts,
    sums: &mut Sums,
    to: &mut BlockAcross,
) {
    let layout = all.layout;
    let patches = layout.of_block(block);
    sums.begin(all, block);
    let first = layout.later_starts[patches.start] as usize;
    source.visit(block, &mut Across { all, first, sums: &mut *sums });

    let is_first = to.starts.capacity() == 0;
    to.starts.clear();
    to.entries.clear();
    for patch in patches {
        to.starts.push(to.entries.len());
        let count = all.count(patch);
        let pairs = layout.later_starts[patch] as usize - first..;
        for (pair, other) in pairs.zip(layout.later(patch)) {
            let others = all.count(*other as usize);
            let start = sums.starts[pair];
            for function in 0..count {
                let from = &sums.entries[start + function * width(others) * LANES..][..others];
                to.entries.extend(from.iter().map(|entry| *entry as f32));
            }
        }
    }
    if is_first {
        to.entries.reserve(to.entries.len() / 4);
    }
}

impl BlockAcross {
    /// The blocks of a patch of the block, one after another.
    pub(super) fn of(&self, patch: usize) -> &[f32] {
        &self.entries[self.starts[patch]..]
    }
}

impl Sums {
    /// Makes room for so many pairs and entries.
    pub(super) fn make_room(&mut self, [pairs, entries]: [usize; 2]) {
        room(&mut self.starts, pairs);
        room(&mut self.entries, entries);
    }

    /// Begins with 0 in the blocks of a block of rows.
    fn begin(&mut self, all: All<'_>, block: usize) {
        let mut end = 0;
        self.starts.clear();
        for patch in all.layout.of_block(block) {
            let count = all.count(patch);
            for other in all.layout.later(patch) {
                self.starts.push(end);
                end += count * width(all.count(*other as usize)) * LANES;
            }
        }
        self.entries.clear();
        self.entries.resize(end, 0.0);
    }
}

/// Adds parts to the sums of a block of rows.
struct Across<'a> {
    all: All<'a>,
    /// The first pair of the block.
    first: usize,
    sums: &'a mut Sums,
}

impl Across<'_> {
    /// Adds a block, by rows, that the matrix has between two rows of different patches, if the other one is eliminated later.
    fn add(&mut self, [row, other]: [usize; 2], block: &[[f64; 3]; 3]) {
        let layout = self.all.layout;
        let [own, to] = [row, other].map(|row| layout.patches[row]);
        if to == NONE || layout.plan.places[to as usize] < layout.plan.places[own as usize] {
            return;
        }
        let pair = layout.later(own as usize).iter().position(|later| *later == to);
        let pair = pair.expect("the layout has every pair of patches");
        let start = self.sums.starts[layout.later_starts[own as usize] as usize - self.first + pair];
        let ((here, count), (there, others)) =
            (self.all.at(own as usize, row), self.all.at(to as usize, other));
        let entries = &mut self.sums.entries[start..start + count * width(others) * LANES];
        dispatch::<f64, _>(Add { here, there, count, block, entries });
    }
}

impl TakeParts for Across<'_> {
    fn alone(&mut self, _: usize, _: &Symmetric3) {}

    fn spring(&mut self, row: usize, other: usize, block: &Symmetric3) {
        let layout = self.all.layout;
        if layout.patches[row] != NONE && layout.patches[row] != layout.patches[other] {
            let negative = square(block).map(|row| row.map(|entry| -entry));
            self.add([row, other], &negative);
        }
    }

    fn element(&mut self, corners: &[u32], own: usize, blocks: &[[[f64; 3]; 3]]) {
        let layout = self.all.layout;
        let row = corners[own] as usize;
        if layout.patches[row] == NONE {
            return;
        }
        for (corner, block) in corners.iter().zip(blocks) {
            if layout.patches[*corner as usize] != layout.patches[row] {
                self.add([row, *corner as usize], block);
            }
        }
    }
}

/// Adds P_iᵀ A P_j.
struct Add<'a> {
    here: &'a [Singles],
    there: &'a [Singles],
    /// How many functions there are here.
    count: usize,
    block: &'a [[f64; 3]; 3],
    entries: &'a mut [f64],
}

impl WithSimd<f64> for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = f64>>(self) {
        let Self { here, there, count, block, entries } = self;
        let [own, other] = [here.len() / 3, there.len() / 3];
        // A P_i by functions, for each axis of the other row.
        let mut pushed = [[0.0; WIDTH]; 3];
        for r in 0..3 {
            for pack in 0..own {
                for lane in 0..LANES {
                    let function = f64::from(here[r * own + pack].0[lane]);
                    for s in 0..3 {
                        pushed[s][pack * LANES + lane] += block[r][s] * function;
                    }
                }
            }
        }
        for pack in 0..other {
            let mut axes = [P::zero(); 3];
            for s in 0..3 {
                axes[s] = P::from_singles(&there[s * other + pack].0);
            }
            let rows = entries.as_chunks_mut::<LANES>().0;
            for function in 0..count {
                let sums = &mut rows[function * other + pack];
                let added = axes[0] * pushed[0][function]
                    + axes[1] * pushed[1][function]
                    + axes[2] * pushed[2][function];
                *sums = (P::load(sums) + added).store();
            }
        }
    }
}
