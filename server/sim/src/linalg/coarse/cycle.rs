//! A V-cycle: smoothing, the level after it, smoothing again.

use super::{
    affine::Interpolation,
    dense::Dense,
    layout::CoarseLayout,
    level::{LEAST_PIECE, LevelLayout, Reach},
    nine::{NineByNine, Unknowns, add_gathered, add_interpolated, add_product, place, subtract_product},
};
use crate::{
    math::{Pack, WithSimd, dispatch},
    parallel::{Own, per_block, per_block_mut},
};

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

/// Products of 9 x 9 blocks with nine numbers that a cycle makes here, but for those of the last level.
#[cfg(test)]
pub(super) fn products(levels: &[LevelLayout], reach: &Reach<'_>) -> usize {
    let [level, next, ..] = levels else { return 0 };
    let (smoothed, left_over) = (2 * reach.own.len() + reach.near.len(), level.rows(reach.own.clone()).len());
    smoothed + 2 * left_over + products(&levels[1..], &Reach::whole(next))
}

/// A V-cycle from a level on.
#[derive(Clone, Copy)]
pub(super) struct Cycle<'a> {
    pub(super) levels: &'a [LevelLayout],
    pub(super) matrices: &'a [LevelMatrix],
    pub(super) top: &'a Dense,
}

impl Cycle<'_> {
    /// x, approximately the inverse times b, where all is known here.
    pub(super) fn run(self, b: &[Unknowns], x: &mut [Unknowns], vectors: &mut CoarseVectors) {
        let CoarseVectors { levels, top, .. } = vectors;
        self.level(b, x, levels, top);
    }

    /// The same where the first level is divided, and has one after it: `complete` makes own residuals on it those of all.
    pub(super) fn run_divided(
        self,
        reach: &Reach<'_>,
        b: &[Unknowns],
        x: &mut [Unknowns],
        vectors: &mut CoarseVectors,
        complete: impl FnOnce(&mut [Unknowns]),
    ) {
        let CoarseVectors { levels, top, .. } = vectors;
        let (first, following) = levels.split_first_mut().expect("a level or more");
        self.down(reach, b, x, &mut first.r);
        complete(&mut first.r);
        self.up(reach, b, x, &mut first.r, following, top);
    }

    /// A cycle from a level on, of which `vectors` are those, as of all that follow.
    fn level(self, b: &[Unknowns], x: &mut [Unknowns], vectors: &mut [LevelVectors], top: &mut [f64]) {
        let (first, following) = vectors.split_first_mut().expect("a level or more");
        if following.is_empty() {
            self.solve_top(b, x, top);
            return;
        }
        let reach = &Reach::whole(&self.levels[0]);
        self.down(reach, b, x, &mut first.r);
        self.up(reach, b, x, &mut first.r, following, top);
    }

    /// Smooths once, from x = 0, and writes what is left over.
    fn down(self, reach: &Reach<'_>, b: &[Unknowns], x: &mut [Unknowns], r: &mut [Unknowns]) {
        let smoother = &self.matrices[0].smoother;
        let fields = (per_block_mut(x), per_block(b), per_block(smoother));
        reach.each_own().each(fields, |_, (x, b, smoother)| {
            *x = [0.0; 12];
            add_product(x, smoother, b);
        });
        for &i in reach.near {
            let i = i as usize;
            x[i] = [0.0; 12];
            add_product(&mut x[i], &smoother[i], &b[i]);
        }
        self.leave_over(reach, b, x, r);
    }

    /// Adds what the levels that follow make of what is left over, and smooths again.
    fn up(
        self,
        reach: &Reach<'_>,
        b: &[Unknowns],
        x: &mut [Unknowns],
        r: &mut [Unknowns],
        following: &mut [LevelVectors],
        top: &mut [f64],
    ) {
        let (level, next) = (&self.levels[0], &self.levels[1]);
        let (next_b, next_x) = (&mut following[0].b, &mut following[0].x);
        let (mut next_b, mut next_x) = (std::mem::take(next_b), std::mem::take(next_x));
        let parents = Own::whole(next_b.len(), 1).in_pieces_of(LEAST_PIECE);
        parents.each(per_block_mut(&mut next_b), |parent, next_b| {
            *next_b = [0.0; 12];
            for &part in next.children(parent) {
                add_gathered(next_b, &level.interpolations[part as usize], &r[part as usize]);
            }
        });
        let cycle = Self { levels: &self.levels[1..], matrices: &self.matrices[1..], ..self };
        cycle.level(&next_b, &mut next_x, following, top);

        let add = |x: &mut Unknowns, weights: &Interpolation, parent: u32| {
            add_interpolated(x, weights, &next_x[parent as usize]);
        };
        let fields = (per_block_mut(x), per_block(&level.interpolations), per_block(&level.parents));
        reach.each_own().each(fields, |_, (x, weights, parent)| add(x, weights, *parent));
        for &i in reach.near {
            let i = i as usize;
            add(&mut x[i], &level.interpolations[i], level.parents[i]);
        }
        (following[0].b, following[0].x) = (next_b, next_x);

        self.leave_over(reach, b, x, r);
        let fields = (per_block_mut(x), per_block(r), per_block(&self.matrices[0].smoother));
        reach.each_own().each(fields, |_, (x, r, smoother)| add_product(x, smoother, r));
    }

    /// Writes b - A x of own aggregates.
    fn leave_over(self, reach: &Reach<'_>, b: &[Unknowns], x: &[Unknowns], r: &mut [Unknowns]) {
        reach.each_own().each(per_block_mut(r), |i, r| *r = self.residual(i, b, x));
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
