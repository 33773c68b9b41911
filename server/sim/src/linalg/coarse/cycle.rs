//! A V-cycle: smoothing, the level after it, smoothing again.

use super::{
    dense::Dense,
    layout::{CoarseLayout, LevelLayout},
    nine::{NineByNine, Unknowns, add_gathered, add_interpolated, add_product, place, subtract_product},
};
use crate::{
    math::{Pack, WithSimd, dispatch},
    parallel::{Own, per_block, per_block_mut},
};

/// Aggregates that a thread takes, at least.
pub(super) const LEAST_PIECE: usize = 32;

/// The matrix on a level.
#[derive(Clone, Debug, Default)]
pub(super) struct LevelMatrix {
    /// By rows, as the layout says.
    pub(super) blocks: Vec<NineByNine>,
    /// Inverses of the diagonal blocks, damped.
    pub(super) smoother: Vec<NineByNine>,
}

/// Right-hand side, solution and residual on the levels after the first, and the residual on the first.
#[derive(Clone, Debug, Default)]
pub(crate) struct CoarseVectors {
    levels: Vec<LevelVectors>,
    top: Vec<f64>,
    /// Of each block of rows: the product of right-hand side and solution, and the sum of the magnitudes of its terms.
    pub(super) products: Vec<[f64; 2]>,
}

#[derive(Clone, Debug, Default)]
struct LevelVectors {
    b: Vec<Unknowns>,
    x: Vec<Unknowns>,
    r: Vec<Unknowns>,
}

impl CoarseVectors {
    pub(super) fn size_for(&mut self, layout: &CoarseLayout) {
        self.levels.resize_with(layout.levels.len(), LevelVectors::default);
        for (number, (vectors, level)) in self.levels.iter_mut().zip(&layout.levels).enumerate() {
            vectors.r.resize(level.len(), [0.0; 12]);
            if number > 0 {
                vectors.b.resize(level.len(), [0.0; 12]);
                vectors.x.resize(level.len(), [0.0; 12]);
            }
        }
        self.products.resize(layout.levels[0].len() / layout.per_block(), [0.0; 2]);
        self.top.resize(layout.levels[layout.levels.len() - 1].len() * 9, 0.0);
    }
}

/// A V-cycle from a level on.
#[derive(Clone, Copy)]
pub(super) struct Cycle<'a> {
    pub(super) levels: &'a [LevelLayout],
    pub(super) matrices: &'a [LevelMatrix],
    pub(super) top: &'a Dense,
}

impl Cycle<'_> {
    /// x, approximately the inverse times b.
    pub(super) fn start(self, b: &[Unknowns], x: &mut [Unknowns], vectors: &mut CoarseVectors) {
        let CoarseVectors { levels, top, .. } = vectors;
        let (first, following) = levels.split_first_mut().expect("a level or more");
        self.run(b, x, &mut first.r, following, top);
    }

    /// The same from a level on; `r` and the vectors of the levels that follow are scratch memory.
    fn run(
        self,
        b: &[Unknowns],
        x: &mut [Unknowns],
        r: &mut [Unknowns],
        following: &mut [LevelVectors],
        top: &mut [f64],
    ) {
        let Some((next, others)) = following.split_first_mut() else {
            self.solve_top(b, x, top);
            return;
        };
        let LevelVectors { b: next_b, x: next_x, r: next_r } = next;
        let level = &self.levels[0];

        x.fill([0.0; 12]);
        self.smooth(b, x);
        let parents = Own::whole(next_b.len(), 1).in_pieces_of(LEAST_PIECE / 4);
        parents.each(per_block_mut(next_b), |parent, next_b| {
            *next_b = [0.0; 12];
            for &part in self.levels[1].children(parent) {
                let part = part as usize;
                add_gathered(next_b, &level.interpolations[part], &self.residual(part, b, x));
            }
        });

        let following = Self { levels: &self.levels[1..], matrices: &self.matrices[1..], ..self };
        following.run(next_b, next_x, next_r, others, top);

        let all = Own::whole(x.len(), 1).in_pieces_of(LEAST_PIECE);
        let fields = (per_block_mut(x), per_block(&level.interpolations), per_block(&level.parents));
        all.each(fields, |_, (x, weights, parent)| add_interpolated(x, weights, &next_x[*parent as usize]));
        all.each(per_block_mut(r), |i, r| *r = self.residual(i, b, x));
        self.smooth(r, x);
    }

    /// x += S b, S the damped inverse diagonal blocks.
    fn smooth(self, b: &[Unknowns], x: &mut [Unknowns]) {
        let all = Own::whole(x.len(), 1).in_pieces_of(LEAST_PIECE);
        let fields = (per_block_mut(x), per_block(b), per_block(&self.matrices[0].smoother));
        all.each(fields, |_, (x, b, smoother)| add_product(x, smoother, b));
    }

    /// b - A x of an aggregate.
    fn residual(self, aggregate: usize, b: &[Unknowns], x: &[Unknowns]) -> Unknowns {
        dispatch::<f64, _>(Residual { cycle: self, aggregate, b, x })
    }

    fn solve_top(self, b: &[Unknowns], x: &mut [Unknowns], top: &mut [f64]) {
        for (top, b) in top.chunks_exact_mut(9).zip(b) {
            for row in 0..9 {
                top[row] = b[place(row)];
            }
        }
        self.top.solve(top);
        for (top, x) in top.chunks_exact(9).zip(x) {
            *x = [0.0; 12];
            for row in 0..9 {
                x[place(row)] = top[row];
            }
        }
    }
}

struct Residual<'a> {
    cycle: Cycle<'a>,
    aggregate: usize,
    b: &'a [Unknowns],
    x: &'a [Unknowns],
}

impl WithSimd<f64> for Residual<'_> {
    type Output = Unknowns;

    #[inline(always)]
    fn run<P: Pack<Number = f64>>(self) -> Unknowns {
        let (level, blocks) = (&self.cycle.levels[0], &self.cycle.matrices[0].blocks);
        let row = level.row(self.aggregate);
        let mut r = self.b[self.aggregate];
        for (block, column) in blocks[row.clone()].iter().zip(&level.columns[row]) {
            subtract_product(&mut r, block, &self.x[*column as usize]);
        }
        r
    }
}
