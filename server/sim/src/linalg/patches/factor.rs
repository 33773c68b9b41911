//! The multifrontal factorisation: fronts from the leaves of the tree on (Duff and Reid 1983). Each is assembled from its own
//! entries and from what its children pass on. Subtrees are computed by several threads, sums by one and in one order.

use super::{
    across::{All, BlockAcross},
    dense::{Dense, height, rest_height},
    layout::MatrixParts,
    plan::Plan,
    singles::{Singles, flat, flat_mut},
    sizes::{Size, Sizes},
};
use crate::{math::LANES, parallel::join};

/// What fronts are assembled from.
#[derive(Clone, Copy)]
pub(super) struct Assembly<'a> {
    pub(super) all: All<'a>,
    pub(super) across: &'a [BlockAcross],
    pub(super) sizes: &'a Sizes,
    pub(super) source: &'a dyn MatrixParts,
}

/// The columns of a front.
struct Columns<'a> {
    size: Size,
    panel: &'a mut [Singles],
    rest: &'a mut [Singles],
}

impl Columns<'_> {
    /// Entries of a column from its own row on, at least.
    fn column(&mut self, column: usize) -> Column<'_> {
        let Size { rows, pivots, .. } = self.size;
        if column < pivots {
            let height = height(rows);
            let entries = flat_mut(&mut self.panel[column * height..(column + 1) * height]);
            return Column { entries, above: 0 };
        }
        let (place, height) = (column - pivots, rest_height(rows, pivots));
        let entries = flat_mut(&mut self.rest[place * height..(place + 1) * height]);
        Column { entries, above: pivots / LANES * LANES }
    }
}

/// A column without so many rows above.
struct Column<'a> {
    entries: &'a mut [f32],
    above: usize,
}

impl Column<'_> {
    /// Adds entries from a row on.
    fn add(&mut self, row: usize, entries: &[f32]) {
        let start = row - self.above;
        for (to, from) in self.entries[start..start + entries.len()].iter_mut().zip(entries) {
            *to += from;
        }
    }
}

impl Assembly<'_> {
    fn plan(&self) -> &Plan {
        &self.all.layout.plan
    }

    /// Factors a front and those below it: panels of these, and memory whose first part takes what it passes on.
    pub(super) fn factor(self, number: u32, panels: &mut [Singles], memory: &mut [Singles]) {
        if self.source.is_given_up() {
            return;
        }
        let front = &self.plan().fronts[number as usize];
        let size = self.sizes.fronts[number as usize];
        let own = panels.len() - size.pivots * height(size.rows);
        let (below, panel) = panels.split_at_mut(own);
        match front.children[..] {
            [only] => self.factor(only, below, memory),
            [left, right] => {
                let (of_left, of_right) = below.split_at_mut(self.sizes.panels_below(self.plan(), left));
                let second = self.sizes.second(front, left);
                if front.is_heavy {
                    let (of_first, of_second) = memory.split_at_mut(second);
                    join(|| self.factor(left, of_left, of_first), || self.factor(right, of_right, of_second));
                    // Side by side, as where one has worked after the other.
                    let [first, other] = [left, right].map(|child| self.sizes.fronts[child as usize].rest);
                    memory.copy_within(second..second + other, first);
                } else {
                    self.factor(left, of_left, memory);
                    self.factor(right, of_right, &mut memory[second..]);
                }
            }
            _ => {}
        }

        let end = self.sizes.passed(front);
        let (passed, own) = memory.split_at_mut(end);
        let (rest, packed) = own.split_at_mut(size.rest);
        panel.fill(Singles::ZERO);
        rest.fill(Singles::ZERO);
        let mut columns = Columns { size, panel, rest };
        self.write_own(number, &mut columns);
        let mut start = 0;
        for &child in &front.children {
            self.add_child([child, number], &passed[start..], &mut columns);
            start += self.sizes.fronts[child as usize].rest;
        }
        let Columns { panel, rest, .. } = columns;
        Dense { rows: size.rows, pivots: size.pivots, panel, rest, packed }.factor();
        memory.copy_within(end..end + size.rest, 0);
    }

    /// Writes what the patches of a front have with themselves and with those that are eliminated later.
    fn write_own(&self, number: u32, columns: &mut Columns<'_>) {
        let Self { all, across, sizes, .. } = *self;
        let plan = self.plan();
        let front = &plan.fronts[number as usize];
        for place in front.pivots.clone() {
            let patch = plan.order[place as usize] as usize;
            let (block, in_block) = all.find(patch);
            let first = sizes.row(front, number, front.row(place));
            let (count, within) = (block.places[in_block].count, block.within(in_block));
            for column in 0..count {
                let entries = &within[column * count + column..(column + 1) * count];
                columns.column(first + column).add(first + column, entries);
            }
            let block = all.layout.rows(patch)[0] as usize / all.layout.block_size;
            let mut entries = across[block].of(in_block);
            for other in all.layout.later(patch) {
                let others = all.count(*other as usize);
                let row = sizes.row(front, number, front.row(plan.places[*other as usize]));
                for column in 0..count {
                    let (of_column, following) = entries.split_at(others);
                    columns.column(first + column).add(row, of_column);
                    entries = following;
                }
            }
        }
    }

    /// Adds what a child passes on.
    fn add_child(&self, [child, parent]: [u32; 2], passed: &[Singles], columns: &mut Columns<'_>) {
        let plan = self.plan();
        let Size { rows, pivots, .. } = self.sizes.fronts[child as usize];
        let (height, above) = (rest_height(rows, pivots), pivots / LANES * LANES);
        let runs = self.sizes.runs(plan, [child, parent]);
        for (number, [start, end, to]) in runs.clone().enumerate() {
            for column in start..end {
                let place = column - pivots;
                let from = flat(&passed[place * height..(place + 1) * height]);
                let mut column_to = columns.column(to + column - start);
                column_to.add(to + column - start, &from[column - above..end - above]);
                for [start, end, to] in runs.clone().skip(number + 1) {
                    column_to.add(to, &from[start - above..end - above]);
                }
            }
        }
    }
}
