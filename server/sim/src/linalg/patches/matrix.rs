//! The matrix on the functions of patches, factored: what a solve sets up.

use super::{
    across::{self, All, BlockAcross, join_others},
    factor::Assembly,
    gather::{self, BlockFunctions, gather},
    layout::{MatrixParts, PatchLayout},
    singles::{Singles, fit, flat},
    sizes::Sizes,
    solve::Factors,
    transfer::{Block, prolong, restrict},
};
use crate::{
    linalg::precondition::Inverse3,
    math::{Real, Sixteen},
    parallel::{Lent, Own, Spare, per_block_mut, thread_count},
};

/// Functions of patches and the factors of Pᵀ A P.
#[derive(Debug, Default)]
pub struct PatchMatrix {
    functions: Vec<BlockFunctions>,
    across: Vec<BlockAcross>,
    sizes: Sizes,
    panels: Vec<Singles>,
    /// What fronts pass on while they are factored.
    memory: Vec<Singles>,
    /// The first unknown of each patch, and one more; the same of each block.
    starts: Vec<u32>,
    block_starts: Vec<u32>,
    /// Where the unknowns of each patch stand in the vectors of fronts.
    places: Vec<u32>,
    vectors: Spare<Vectors>,
    gathered: Spare<gather::Sums>,
    joined: Spare<across::Sums>,
}

/// A right-hand side and the vectors of fronts.
#[derive(Clone, Debug, Default)]
pub(super) struct Vectors {
    /// Pᵀ r, by patches.
    pub(super) b: Vec<f32>,
    fronts: Vec<Singles>,
}

impl Clone for PatchMatrix {
    /// An empty one: a solve sets it up.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl PatchMatrix {
    /// Makes functions and factors from the parts of a matrix, whose inverse diagonal blocks these are.
    pub(crate) fn set_up(&mut self, layout: &PatchLayout, source: &dyn MatrixParts, inverse: &[Inverse3]) {
        let blocks = layout.blocks();
        let each = Own::whole(blocks, 1);
        self.functions.resize_with(blocks, BlockFunctions::default);
        self.across.resize_with(blocks, BlockAcross::default);
        let at_once = thread_count().min(blocks);
        let Self { functions, across, gathered, joined, .. } = &mut *self;
        gathered.ready(at_once, |sums| sums.make_room(layout));
        let gathered = &*gathered;
        each.each_with(
            || gathered.lend(),
            per_block_mut(functions),
            |sums, block, functions| {
                if !source.is_given_up() {
                    gather((layout, block), source, inverse, sums, functions);
                }
            },
        );
        // What is not made is not used: a solve that nobody waits for ends before it begins.
        if source.is_given_up() {
            return;
        }

        let all = All { layout, blocks: functions };
        let most = all.most();
        joined.ready(at_once, |sums| sums.make_room(most));
        let joined = &*joined;
        each.each_with(
            || joined.lend(),
            per_block_mut(across),
            |sums, block, across| {
                if !source.is_given_up() {
                    join_others(all, block, source, sums, across);
                }
            },
        );
        if source.is_given_up() {
            return;
        }
        self.count(layout);

        let Self { functions, across, sizes, panels, memory, .. } = self;
        let Some(root) = sizes.fronts.len().checked_sub(1) else { return };
        fit(panels, sizes.panels);
        fit(memory, sizes.fronts[root].need);
        let all = All { layout, blocks: functions };
        Assembly { all, across, sizes, source }.factor(root as u32, panels, memory);
    }

    /// Counts the unknowns of patches, blocks and fronts.
    fn count(&mut self, layout: &PatchLayout) {
        let Self { functions, sizes, starts, block_starts, places, vectors, .. } = self;
        let all = All { layout, blocks: functions };
        sizes.fit(layout, &|patch| all.count(patch));
        let mut end = 0;
        starts.clear();
        starts.push(0);
        block_starts.clear();
        block_starts.push(0);
        places.clear();
        for block in 0..layout.blocks() {
            for patch in layout.of_block(block) {
                end += all.count(patch) as u32;
                starts.push(end);
                places.push(sizes.place(&layout.plan, patch as u32) as u32);
            }
            block_starts.push(end);
        }
        let Vectors { b, fronts } = &mut *vectors.lend();
        b.clear();
        b.resize(end as usize, 0.0);
        fit(fronts, sizes.vectors);
    }

    /// The vectors of a solve.
    pub(super) fn vectors(&self) -> Lent<'_, Vectors> {
        self.vectors.lend()
    }

    /// The first unknown of each block, and one more.
    pub(super) fn block_starts(&self) -> &[u32] {
        &self.block_starts
    }

    /// Writes Pᵀ r of a block.
    pub(super) fn restrict<R: Real>(
        &self,
        (layout, number): (&PatchLayout, usize),
        r: &[Sixteen<R>],
        to: &mut [f32],
    ) {
        restrict(Block { layout, number, functions: &self.functions[number] }, r, to);
    }

    /// Solves for Pᵀ r.
    pub(super) fn solve(&self, layout: &PatchLayout, Vectors { b, fronts }: &mut Vectors) {
        let all = All { layout, blocks: &self.functions };
        Factors { all, sizes: &self.sizes, panels: &self.panels, starts: &self.starts, b }.solve(fronts);
    }

    /// Adds P c to a block, c the last solution.
    pub(super) fn prolong<R: Real>(
        &self,
        (layout, number): (&PatchLayout, usize),
        vectors: &Vectors,
        z: &mut [Sixteen<R>],
    ) {
        let block = Block { layout, number, functions: &self.functions[number] };
        prolong(block, &self.places, flat(&vectors.fronts), z);
    }

    /// How many functions there are.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.starts.last().map_or(0, |end| *end as usize)
    }
}
