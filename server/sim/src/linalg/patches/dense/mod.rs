//! Partial Cholesky factorisation of a dense front: pivots are eliminated, the rest is passed on.
//!
//! A front has n rows, in packs of sixteen. The columns of its p pivots are the panel; those of the other rows, without the
//! packs above the last pivots, are the rest. Panels of 48 columns are factored by rows of sixteen, and what they take from
//! columns after them is computed in tiles of 16 x 6. Each entry is added up by one thread in one order, nothing is fused.

use std::ops::Range;

use super::singles::Singles;
use crate::{
    math::{LANES, Pack, WithSimd, dispatch},
    parallel::join,
};

/// Columns that are factored at a time; a multiple of sixteen and of six.
pub(super) const PANEL: usize = 48;
/// Columns of a tile.
const TILE: usize = 6;
/// A pivot below this, of a matrix whose diagonal is 1, is rounding: its unknown is left out.
const SMALLEST_PIVOT: f32 = 1e-7;
/// Rows from which on a front is worked on by several threads.
const SHARED: usize = 400;
/// Packs of rows that a thread takes, at least, and columns.
const LEAST_PACKS: usize = 8;
const LEAST_COLUMNS: usize = 48;

/// A front that is assembled: only entries below the diagonal count, and those on it. After factoring, the panel holds L,
/// inverse pivots on its diagonal, 0 above it in the packs that a column begins in.
pub(super) struct Dense<'a> {
    /// Rows and pivots.
    pub(super) rows: usize,
    pub(super) pivots: usize,
    pub(super) panel: &'a mut [Singles],
    pub(super) rest: &'a mut [Singles],
    /// Scratch memory: [`PANEL`] packs per pack of rows.
    pub(super) packed: &'a mut [Singles],
}

/// Factored columns between their own rows.
struct Pivots {
    /// `columns[t][j]`: L in row j of column t, j > t.
    columns: [[f32; PANEL]; PANEL],
    /// 1 / L on the diagonal, 0 of those that are left out.
    inverse: [f32; PANEL],
}

/// Who works on a front.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Workers {
    One,
    Several,
}

/// Packs per column of the panel.
pub(super) fn height(rows: usize) -> usize {
    rows.div_ceil(LANES)
}

/// Packs per column of the rest.
pub(super) fn rest_height(rows: usize, pivots: usize) -> usize {
    height(rows) - pivots / LANES
}

impl Dense<'_> {
    /// Eliminates the pivots.
    pub(super) fn factor(self) {
        let Self { rows, pivots: count, panel, rest, packed } = self;
        let height = height(rows);
        let by = if rows >= SHARED { Workers::Several } else { Workers::One };
        let mut pivots = Pivots { columns: [[0.0; PANEL]; PANEL], inverse: [0.0; PANEL] };
        for first in (0..count).step_by(PANEL) {
            let columns = PANEL.min(count - first);
            dispatch::<f32, _>(Diagonal { panel: &mut *panel, height, first, columns, pivots: &mut pivots });
            let below = first + columns;
            if below == rows {
                break;
            }
            // The pack that the rows below begin in was factored with the pivots.
            let (begin, whole) = (below / LANES, below.div_ceil(LANES));
            let packed = &mut packed[..(height - begin) * columns];
            let (mixed, others) = packed.split_at_mut((whole - begin) * columns);
            let at = (begin - first / LANES) * LANES;
            for (to, column) in mixed.iter_mut().zip(&pivots.columns) {
                to.0.copy_from_slice(&column[at..at + LANES]);
            }
            let solve = Solve { panel: &*panel, height, first, columns, pivots: &pivots };
            solve.rows(whole..height, others, by);
            for (pack, of_pack) in (whole..).zip(others.chunks_exact(columns)) {
                for (column, entries) in (first..).zip(of_pack) {
                    panel[column * height + pack] = *entries;
                }
            }

            let update = Update { packed: &*packed, begin, columns, height };
            let later = &mut panel[below * height..count * height];
            update.subtract(below..count, later, [height, 0], by);
            let shape = [rest_height(rows, count), count / LANES];
            update.subtract(count..rows, rest, shape, by);
        }
    }
}

/// Factors columns between their own rows, and the packs that these are in.
struct Diagonal<'a> {
    panel: &'a mut [Singles],
    height: usize,
    first: usize,
    columns: usize,
    pivots: &'a mut Pivots,
}

impl WithSimd<f32> for Diagonal<'_> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = f32>>(self) {
        let Self { panel, height, first, columns, pivots } = self;
        let packs = columns.div_ceil(LANES);
        for j in 0..columns {
            let (own, lane) = (j / LANES, j % LANES);
            let start = (first + j) * height + first / LANES;
            let (before, this) = pivots.columns.split_at_mut(j);
            let this = &mut this[0];
            for pack in own..packs {
                let mut y = P::load(&panel[start + pack].0);
                for column in before.iter() {
                    y -= P::load(pack_of(column, pack)) * column[j];
                }
                this[pack * LANES..(pack + 1) * LANES].copy_from_slice(&y.store());
            }
            let pivot = this[j];
            let inverse = if pivot > SMALLEST_PIVOT && pivot.is_finite() { 1.0 / pivot.sqrt() } else { 0.0 };
            pivots.inverse[j] = inverse;
            for pack in own..packs {
                // What is left out may be no number.
                let scaled = if inverse > 0.0 { P::load(pack_of(this, pack)) * inverse } else { P::zero() };
                let mut entries = scaled.store();
                if pack == own {
                    entries[..lane].fill(0.0);
                }
                this[pack * LANES..(pack + 1) * LANES].copy_from_slice(&entries);
                if pack == own {
                    entries[lane] = inverse;
                }
                panel[start + pack] = Singles(entries);
            }
        }
    }
}

/// Sixteen of the rows of a column.
#[inline(always)]
fn pack_of(column: &[f32; PANEL], pack: usize) -> &[f32; LANES] {
    &column.as_chunks::<LANES>().0[pack]
}

/// Solves for the rows below the pivots.
#[derive(Clone, Copy)]
struct Solve<'a> {
    panel: &'a [Singles],
    height: usize,
    first: usize,
    columns: usize,
    pivots: &'a Pivots,
}

impl Solve<'_> {
    /// Writes L in some packs of rows, pack after pack.
    fn rows(self, packs: Range<usize>, to: &mut [Singles], by: Workers) {
        if by == Workers::Several && packs.len() >= 2 * LEAST_PACKS {
            let half = packs.len() / 2;
            let (left, right) = to.split_at_mut(half * self.columns);
            let middle = packs.start + half;
            join(|| self.rows(packs.start..middle, left, by), || self.rows(middle..packs.end, right, by));
            return;
        }
        dispatch::<f32, _>(SolveRows { solve: self, packs, to });
    }
}

struct SolveRows<'a> {
    solve: Solve<'a>,
    packs: Range<usize>,
    to: &'a mut [Singles],
}

impl WithSimd<f32> for SolveRows<'_> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = f32>>(self) {
        let Solve { panel, height, first, columns, pivots } = self.solve;
        for (pack, to) in self.packs.zip(self.to.chunks_exact_mut(columns)) {
            for begin in (0..columns).step_by(TILE) {
                let count = TILE.min(columns - begin);
                let mut y = [P::zero(); TILE];
                for j in 0..count {
                    y[j] = P::load(&panel[(first + begin + j) * height + pack].0);
                }
                for (x, column) in to[..begin].iter().zip(&pivots.columns) {
                    let (x, entries) = (P::load(&x.0), &column[begin..begin + TILE]);
                    for j in 0..TILE {
                        y[j] -= x * entries[j];
                    }
                }
                for j in 0..count {
                    for t in 0..j {
                        let taken = y[t] * pivots.columns[begin + t][begin + j];
                        y[j] -= taken;
                    }
                    y[j] = y[j] * pivots.inverse[begin + j];
                    to[begin + j] = Singles(y[j].store());
                }
            }
        }
    }
}

/// What factored columns take from those after them.
#[derive(Clone, Copy)]
struct Update<'a> {
    /// L of these columns, by packs of rows from one on.
    packed: &'a [Singles],
    begin: usize,
    columns: usize,
    height: usize,
}

impl<'a> Update<'a> {
    /// Subtracts it from some columns, which have so many packs each, without as many above.
    fn subtract(self, columns: Range<usize>, from: &mut [Singles], [height, above]: [usize; 2], by: Workers) {
        let middle = (columns.start.midpoint(columns.end)).next_multiple_of(LANES);
        if by == Workers::Several && columns.len() >= 2 * LEAST_COLUMNS && middle < columns.end {
            let (left, right) = from.split_at_mut((middle - columns.start) * height);
            join(
                || self.subtract(columns.start..middle, left, [height, above], by),
                || self.subtract(middle..columns.end, right, [height, above], by),
            );
            return;
        }
        dispatch::<f32, _>(Subtract { update: self, columns, from, height, above });
    }

    /// L of these columns in a pack of rows.
    #[inline(always)]
    fn pack(self, pack: usize) -> &'a [Singles] {
        let start = (pack - self.begin) * self.columns;
        &self.packed[start..start + self.columns]
    }
}

struct Subtract<'a> {
    update: Update<'a>,
    columns: Range<usize>,
    from: &'a mut [Singles],
    height: usize,
    above: usize,
}

impl WithSimd<f32> for Subtract<'_> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = f32>>(mut self) {
        let packs = self.columns.start / LANES..self.columns.end.div_ceil(LANES);
        for across in packs {
            let b = self.update.pack(across);
            for down in across..self.update.height {
                let a = self.update.pack(down);
                self.tile::<P, 0, TILE>([a, b], [down, across]);
                self.tile::<P, TILE, TILE>([a, b], [down, across]);
                self.tile::<P, { 2 * TILE }, { LANES - 2 * TILE }>([a, b], [down, across]);
            }
        }
    }
}

impl Subtract<'_> {
    /// Sixteen rows of `COUNT` columns, `FIRST` being the first one's place in its pack.
    #[inline(always)]
    fn tile<P: Pack<Number = f32>, const FIRST: usize, const COUNT: usize>(
        &mut self,
        [a, b]: [&[Singles]; 2],
        [down, across]: [usize; 2],
    ) {
        let first = across * LANES + FIRST;
        if first + COUNT <= self.columns.start || first >= self.columns.end {
            return;
        }
        let mut sums = [P::zero(); COUNT];
        for (a, b) in a.iter().zip(b) {
            let a = P::load(&a.0);
            for j in 0..COUNT {
                sums[j] += a * b.0[FIRST + j];
            }
        }
        for j in 0..COUNT {
            let column = first + j;
            if self.columns.contains(&column) {
                let place = (column - self.columns.start) * self.height + down - self.above;
                let entries = &mut self.from[place].0;
                *entries = (P::load(entries) - sums[j]).store();
            }
        }
    }
}

#[cfg(test)]
mod tests;
