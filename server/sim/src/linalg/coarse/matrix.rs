//! The matrix on a coarse space, and on its coarser levels.

use super::{
    cycle::{Cycle, LevelMatrix},
    dense::Dense,
    layout::CoarseLayout,
    level::{LEAST_PIECE, LevelLayout, Reach},
    nine::{NineByNine, add_coarsened, place, scaled_inverse},
};
use crate::{
    linalg::rows::fill_rows,
    math::{Pack, WithSimd, dispatch},
    parallel::per_block_mut,
};

/// Pᵀ A P on every level, and what solves with it.
#[derive(Clone, Debug, Default)]
pub struct CoarseMatrix {
    pub(super) levels: Vec<LevelMatrix>,
    top: Dense,
}

/// What a smoothing step multiplies the inverse diagonal blocks by. A spring joins two aggregates at most, so that the
/// eigenvalues of the inverse diagonal blocks times a matrix of springs are at most 2: below 1 the V-cycle is positive
/// definite, and near 0.72 it smooths best (a Chebyshev step over the upper two thirds). An element may join more
/// aggregates, where their corners meet; a solve notices if that ever makes the cycle indefinite.
const DAMPING: f64 = 0.72;

impl CoarseMatrix {
    /// Fills the blocks between aggregates, those of an own block of rows at a time and in parallel: `fill(block, places)`,
    /// where [`CoarseLayout::place`] says which is which; then makes what follows from them, with what other ranks made.
    pub(crate) fn fill(&mut self, layout: &CoarseLayout, fill: &(impl Fn(usize, &mut [NineByNine]) + Sync)) {
        self.levels.resize_with(layout.levels.len(), LevelMatrix::default);
        for (matrix, level) in self.levels.iter_mut().zip(&layout.levels) {
            matrix.blocks.resize(level.columns.len(), [[0.0; 12]; 9]);
            matrix.smoother.resize(level.len(), [[0.0; 12]; 9]);
        }

        let (rank, finest) = (layout.rank(), &mut self.levels[0]);
        let fill = |block: usize, _: &[u32], blocks: &mut [NineByNine]| fill(block, blocks);
        let (own, columns) = (layout.share.blocks_of(rank), &layout.levels[0].columns);
        fill_rows(own, layout.block_starts(), columns, &mut finest.blocks, 1, &fill);
        let division = layout.division.as_deref();
        match division {
            Some(division) => layout.share.exchange_over(&division.blocks, [&mut finest.blocks]),
            None => layout.share.complete(&mut finest.blocks, |rank| layout.entries_of(rank)),
        }
        for (number, pair) in layout.levels.windows(2).enumerate() {
            let [fine, coarse] = &mut self.levels[number..number + 2] else { unreachable!("two levels") };
            let [of_fine, of_coarse] = [&pair[0], &pair[1]];
            let division = division.filter(|_| number == 0);
            let reach = if number == 0 { layout.reach() } else { Reach::whole(of_fine) };
            fine.make_smoother(of_fine, &reach);
            let fine_blocks = &*fine.blocks;
            let coarsen = |parent: usize, columns: &[u32], blocks: &mut [NineByNine]| {
                let parts = of_coarse.children(parent);
                dispatch::<f64, _>(Coarsen { fine: (of_fine, fine_blocks), parts, columns, blocks });
            };
            let (columns, blocks) = (&of_coarse.columns, &mut coarse.blocks);
            let parents = division.map_or(0..of_coarse.len(), |division| division.parents_of(rank));
            fill_rows(parents, &of_coarse.starts, columns, blocks, LEAST_PIECE, &coarsen);
            if let Some(division) = division {
                let of_rank = |rank| of_coarse.rows(division.parents_of(rank));
                layout.share.complete(blocks, of_rank);
            }
        }
        self.factor_top(&layout.levels[layout.levels.len() - 1]);
    }

    fn factor_top(&mut self, level: &LevelLayout) {
        let blocks = &self.levels[self.levels.len() - 1].blocks;
        self.top.clear(level.len() * 9);
        for i in 0..level.len() {
            for k in level.row(i) {
                let j = level.columns[k] as usize;
                for (column, entries) in blocks[k].iter().enumerate() {
                    for row in 0..9 {
                        *self.top.entry(9 * i + row, 9 * j + column) = entries[place(row)];
                    }
                }
            }
        }
        self.top.factor();
    }

    /// What solves with it from the finest level on.
    pub(super) fn cycle<'a>(&'a self, layout: &'a CoarseLayout) -> Cycle<'a> {
        Cycle { levels: &layout.levels, matrices: &self.levels, top: &self.top }
    }
}

impl LevelMatrix {
    /// Inverts the diagonal blocks of what is worked on here.
    fn make_smoother(&mut self, level: &LevelLayout, reach: &Reach<'_>) {
        let blocks = &*self.blocks;
        let inverse = |i: usize| scaled_inverse(&blocks[level.diagonal(i)], DAMPING);
        reach.each_own().each(per_block_mut(&mut self.smoother), |i, smoother| *smoother = inverse(i));
        reach.near.iter().for_each(|i| self.smoother[*i as usize] = inverse(*i as usize));
    }
}

struct Coarsen<'a> {
    fine: (&'a LevelLayout, &'a [NineByNine]),
    /// What the aggregate of the row is made of.
    parts: &'a [u32],
    columns: &'a [u32],
    blocks: &'a mut [NineByNine],
}

impl WithSimd<f64> for Coarsen<'_> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = f64>>(self) {
        let (level, fine) = self.fine;
        self.blocks.fill([[0.0; 12]; 9]);
        for &part in self.parts {
            let i = part as usize;
            for k in level.row(i) {
                let j = level.columns[k] as usize;
                let place = self.columns.binary_search(&level.parents[j]);
                let block = &mut self.blocks[place.expect("parents of neighbours are neighbours")];
                let interpolations = &level.interpolations;
                add_coarsened(block, &interpolations[i], &fine[k], &interpolations[j]);
            }
        }
    }
}
