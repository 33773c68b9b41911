//! Solves with the factors: from the leaves of the tree to its root, and back.

use super::{
    across::All,
    dense::height,
    plan::{Front, Plan},
    singles::{Singles, flat, flat_mut},
    sizes::{Size, Sizes},
};
use crate::{
    math::{LANES, Pack, WithSimd, dispatch},
    parallel::join,
};

/// The factors, and where right-hand sides are: by patches, `starts` telling where each begins.
#[derive(Clone, Copy)]
pub(super) struct Factors<'a> {
    pub(super) all: All<'a>,
    pub(super) sizes: &'a Sizes,
    pub(super) panels: &'a [Singles],
    pub(super) starts: &'a [u32],
    pub(super) b: &'a [f32],
}

impl Factors<'_> {
    fn plan(&self) -> &Plan {
        &self.all.layout.plan
    }

    /// Solves: unknowns stand in the vectors of their fronts then.
    pub(super) fn solve(self, vectors: &mut [Singles]) {
        let Some(root) = self.plan().fronts.len().checked_sub(1) else { return };
        self.forward(root as u32, self.panels, vectors);
        self.backward(root as u32, self.panels, vectors);
    }

    /// Goes through the fronts below one, by their panels and vectors: through two at a time where there is enough to do.
    fn each_child(
        self,
        front: &Front,
        panels: &[Singles],
        vectors: &mut [Singles],
        go: fn(Self, u32, &[Singles], &mut [Singles]),
    ) {
        match front.children[..] {
            [only] => go(self, only, panels, vectors),
            [left, right] => {
                let (of_left, of_right) = panels.split_at(self.sizes.panels_below(self.plan(), left));
                let (to_left, to_right) = vectors.split_at_mut(self.sizes.vectors_below(self.plan(), left));
                if front.is_heavy {
                    join(|| go(self, left, of_left, to_left), || go(self, right, of_right, to_right));
                } else {
                    go(self, left, of_left, to_left);
                    go(self, right, of_right, to_right);
                }
            }
            _ => {}
        }
    }

    /// From the leaves to a front: L⁻¹ b, and what it takes from the rows of its border. Panels and vectors are those of
    /// the front and those below it.
    fn forward(self, number: u32, panels: &[Singles], vectors: &mut [Singles]) {
        let front = &self.plan().fronts[number as usize];
        let Size { rows, pivots, .. } = self.sizes.fronts[number as usize];
        let (below, w) = vectors.split_at_mut(vectors.len() - height(rows));
        let (panels, panel) = panels.split_at(panels.len() - pivots * height(rows));
        self.each_child(front, panels, below, Self::forward);

        w.fill(Singles::ZERO);
        let numbers = flat_mut(w);
        let mut to = 0;
        for place in front.pivots.clone() {
            let patch = self.plan().order[place as usize] as usize;
            let of_patch = self.starts[patch] as usize..self.starts[patch + 1] as usize;
            numbers[to..to + of_patch.len()].copy_from_slice(&self.b[of_patch.clone()]);
            to += of_patch.len();
        }
        let mut end = 0;
        for &child in &front.children {
            end += self.sizes.vectors_below(self.plan(), child);
            let passed = flat(&below[end - height(self.sizes.fronts[child as usize].rows)..end]);
            for [start, end, to] in self.sizes.runs(self.plan(), [child, number]) {
                for (to, from) in numbers[to..to + end - start].iter_mut().zip(&passed[start..end]) {
                    *to += from;
                }
            }
        }
        dispatch::<f32, _>(Forward { panel, pivots, w });
    }

    /// From a front, whose border is known, to the leaves.
    fn backward(self, number: u32, panels: &[Singles], vectors: &mut [Singles]) {
        let front = &self.plan().fronts[number as usize];
        let Size { rows, pivots, .. } = self.sizes.fronts[number as usize];
        let (below, w) = vectors.split_at_mut(vectors.len() - height(rows));
        let (panels, panel) = panels.split_at(panels.len() - pivots * height(rows));
        dispatch::<f32, _>(Backward { panel, pivots, w: &mut *w });

        let known = flat(w);
        let mut end = 0;
        for &child in &front.children {
            end += self.sizes.vectors_below(self.plan(), child);
            let first = end - height(self.sizes.fronts[child as usize].rows);
            let asked = flat_mut(&mut below[first..end]);
            for [start, end, from] in self.sizes.runs(self.plan(), [child, number]) {
                asked[start..end].copy_from_slice(&known[from..from + end - start]);
            }
        }
        self.each_child(front, panels, below, Self::backward);
    }
}

/// w = L⁻¹ w in the rows of pivots, and less L w in those below.
struct Forward<'a> {
    panel: &'a [Singles],
    pivots: usize,
    w: &'a mut [Singles],
}

impl WithSimd<f32> for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = f32>>(self) {
        let Self { panel, pivots, w } = self;
        let height = w.len();
        for j in 0..pivots {
            let (pack, lane) = (j / LANES, j % LANES);
            let column = &panel[j * height + pack..(j + 1) * height];
            let known = w[pack].0[lane] * column[0].0[lane];
            for (w, entries) in w[pack..].iter_mut().zip(column) {
                w.0 = (P::load(&w.0) - P::load(&entries.0) * known).store();
            }
            // On the diagonal stands an inverse pivot.
            w[pack].0[lane] = known;
        }
    }
}

/// w = L⁻ᵀ w in the rows of pivots, from those below.
struct Backward<'a> {
    panel: &'a [Singles],
    pivots: usize,
    w: &'a mut [Singles],
}

impl WithSimd<f32> for Backward<'_> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = f32>>(self) {
        let Self { panel, pivots, w } = self;
        let height = w.len();
        for j in (0..pivots).rev() {
            let (pack, lane) = (j / LANES, j % LANES);
            let column = &panel[j * height + pack..(j + 1) * height];
            let right = std::mem::take(&mut w[pack].0[lane]);
            let mut sums = P::zero();
            for (w, entries) in w[pack..].iter().zip(column) {
                sums += P::load(&entries.0) * P::load(&w.0);
            }
            let [a, b, c, d] = sums.fold();
            w[pack].0[lane] = (right - ((a + c) + (b + d))) * column[0].0[lane];
        }
    }
}
