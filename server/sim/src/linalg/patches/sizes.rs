//! How large fronts are with the functions that a set-up found, and where each stands in memory.

use super::{
    dense::{PANEL, height, rest_height},
    layout::PatchLayout,
    plan::{Front, Plan},
};
use crate::math::LANES;

/// Where a front stands; lengths of storage are in packs of sixteen numbers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Size {
    pub(super) rows: usize,
    pub(super) pivots: usize,
    /// Where its panel begins, and its vector.
    panel: usize,
    vector: usize,
    /// Where the rows of its border begin are told.
    border: usize,
    /// What it passes on takes so much, and its subtree while it is factored.
    pub(super) rest: usize,
    pub(super) need: usize,
}

/// The sizes of all fronts.
#[derive(Clone, Debug, Default)]
pub(super) struct Sizes {
    pub(super) fronts: Vec<Size>,
    /// The first unknown at each place, and one more.
    unknowns: Vec<usize>,
    /// The first row of each patch of the borders, front after front.
    borders: Vec<usize>,
    /// Packs of all panels, and of all vectors.
    pub(super) panels: usize,
    pub(super) vectors: usize,
}

impl Sizes {
    /// Fits them to the functions of each patch.
    pub(super) fn fit(&mut self, layout: &PatchLayout, count: &dyn Fn(usize) -> usize) {
        let Plan { fronts, order, .. } = &layout.plan;
        self.unknowns.clear();
        self.unknowns.push(0);
        let mut end = 0;
        for patch in order {
            end += count(*patch as usize);
            self.unknowns.push(end);
        }

        self.fronts.clear();
        self.borders.clear();
        (self.panels, self.vectors) = (0, 0);
        for front in fronts {
            let [start, end] =
                [front.pivots.start, front.pivots.end].map(|place| self.unknowns[place as usize]);
            let pivots = end - start;
            let (border, mut rows) = (self.borders.len(), pivots);
            for place in &front.border {
                self.borders.push(rows);
                rows += self.unknowns[*place as usize + 1] - self.unknowns[*place as usize];
            }
            self.borders.push(rows);
            let rest = (rows - pivots) * rest_height(rows, pivots);
            let of = |child: u32| self.fronts[child as usize];
            let below = match front.children[..] {
                [only] => of(only).need,
                [left, right] => (self.second(front, left) + of(right).need).max(of(left).need),
                _ => 0,
            };
            let need = below.max(self.passed(front) + rest + PANEL * height(rows));
            let (panel, vector) = (self.panels, self.vectors);
            self.fronts.push(Size { rows, pivots, panel, vector, border, rest, need });
            self.panels += pivots * height(rows);
            self.vectors += height(rows);
        }
    }

    /// Where the second child of a front begins to work, after the first one: behind all that it needs, or behind what it
    /// passes on.
    pub(super) fn second(&self, front: &Front, first: u32) -> usize {
        let Size { rest, need, .. } = self.fronts[first as usize];
        if front.is_heavy { need } else { rest }
    }

    /// What the children of a front pass on takes so much.
    pub(super) fn passed(&self, front: &Front) -> usize {
        front.children.iter().map(|child| self.fronts[*child as usize].rest).sum()
    }

    /// Packs that the panels of a front and of those below it take.
    pub(super) fn panels_below(&self, plan: &Plan, front: u32) -> usize {
        let first = self.fronts[plan.fronts[front as usize].first as usize].panel;
        let Size { panel, rows, pivots, .. } = self.fronts[front as usize];
        panel + pivots * height(rows) - first
    }

    /// Packs that their vectors take.
    pub(super) fn vectors_below(&self, plan: &Plan, front: u32) -> usize {
        let first = self.fronts[plan.fronts[front as usize].first as usize].vector;
        let Size { vector, rows, .. } = self.fronts[front as usize];
        vector + height(rows) - first
    }

    /// The first number of each row-patch of a front: of pivots, then of the border.
    pub(super) fn row(&self, front: &Front, number: u32, row: usize) -> usize {
        let pivots = front.pivots.len();
        let start = front.pivots.start as usize;
        if row < pivots {
            return self.unknowns[start + row] - self.unknowns[start];
        }
        self.borders[self.fronts[number as usize].border + row - pivots]
    }

    /// Where the unknowns of a patch stand among the numbers of all vectors.
    pub(super) fn place(&self, plan: &Plan, patch: u32) -> usize {
        let number = plan.front_of[patch as usize];
        let front = &plan.fronts[number as usize];
        let row = (plan.places[patch as usize] - front.pivots.start) as usize;
        self.fronts[number as usize].vector * LANES + self.row(front, number, row)
    }

    /// Runs of numbers of a child's border: where each begins among its rows, where it ends, and where among those of its
    /// parent.
    pub(super) fn runs<'a>(
        &'a self,
        plan: &'a Plan,
        [child, parent]: [u32; 2],
    ) -> impl Iterator<Item = [usize; 3]> + Clone + 'a {
        let (below, above) = (&plan.fronts[child as usize], &plan.fronts[parent as usize]);
        let first = self.fronts[child as usize].border;
        below.runs.iter().map(move |run| {
            let [start, end] =
                [run.border.start, run.border.end].map(|patch| self.borders[first + patch as usize]);
            [start, end, self.row(above, parent, run.place as usize)]
        })
    }
}
