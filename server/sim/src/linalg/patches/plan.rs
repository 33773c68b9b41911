//! What of a factorisation follows from which patches meet: their order, and the rows of every front.

use std::ops::Range;

use super::{graph::Graph, tree::Division};
use crate::interrupt;

/// Products of numbers below a front from which on its children are computed on two threads, if there are as many; and the
/// share of all products that they must be, one part in so many: each part that is computed at a time takes memory.
const HEAVY: f64 = 1e6;
const PARTS: f64 = 8.0;
/// Functions per patch that work is weighed with.
const TYPICAL: f64 = 9.0;

/// Neighbouring rows of a front that are neighbours in its parent too, counted by patches.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Run {
    /// Patches of the border.
    pub(super) border: Range<u32>,
    /// Where the first of them stands among the rows of the parent.
    pub(super) place: u32,
}

/// Patches that are eliminated together, and those that this changes.
#[derive(Clone, Debug)]
pub(super) struct Front {
    /// Places of the patches in the order of elimination.
    pub(super) pivots: Range<u32>,
    /// Places of the others, ascending: all after the pivots.
    pub(super) border: Vec<u32>,
    pub(super) children: Vec<u32>,
    /// The first front of those below it and itself.
    pub(super) first: u32,
    /// How the border stands in the parent.
    pub(super) runs: Vec<Run>,
    /// Whether what is below it is divided between threads.
    pub(super) is_heavy: bool,
}

/// The fronts, each after its children, and the order of patches.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) fronts: Vec<Front>,
    /// The patch at each place.
    pub(super) order: Vec<u32>,
    /// The place of each patch, and its front.
    pub(super) places: Vec<u32>,
    pub(super) front_of: Vec<u32>,
}

impl Front {
    /// Where a patch at a later place stands among the rows: pivots first, then the border.
    pub(super) fn row(&self, place: u32) -> usize {
        if self.pivots.contains(&place) {
            return (place - self.pivots.start) as usize;
        }
        let at = self.border.binary_search(&place).expect("the border has whatever a pivot meets");
        self.pivots.len() + at
    }
}

impl Plan {
    pub(super) fn new(meets: &Graph, divisions: &[Division]) -> Self {
        let (mut order, mut front_of) = (Vec::new(), vec![0; meets.len()]);
        let mut pivots = Vec::new();
        for (number, division) in (0..).zip(divisions) {
            let start = order.len() as u32;
            order.extend(&division.pivots);
            division.pivots.iter().for_each(|patch| front_of[*patch as usize] = number);
            pivots.push(start..order.len() as u32);
        }
        let mut places = vec![0; meets.len()];
        (0..).zip(&order).for_each(|(place, patch)| places[*patch as usize] = place);

        let (mut fronts, mut weights): (Vec<Front>, Vec<[f64; 2]>) = (Vec::new(), Vec::new());
        for (number, (division, pivots)) in divisions.iter().zip(pivots).enumerate() {
            interrupt::point();
            let of_pivots = division.pivots.iter().flat_map(|patch| meets.of(*patch));
            let of_children = division.children.iter().flat_map(|child| &fronts[*child as usize].border);
            let near = of_pivots.map(|patch| places[*patch as usize]).chain(of_children.copied());
            let mut border: Vec<u32> = near.filter(|place| *place >= pivots.end).collect();
            border.sort_unstable();
            border.dedup();

            let [p, q] = [pivots.len(), border.len()].map(|patches| TYPICAL * patches as f64);
            let own = p * (p * p / 3.0 + p * q + q * q);
            let below: f64 = division.children.iter().map(|child| weights[*child as usize][0]).sum();
            weights.push([own + below, below]);
            let below_first = division.children.first().map(|child| fronts[*child as usize].first);
            let first = below_first.unwrap_or(number as u32);
            let (children, runs) = (division.children.clone(), Vec::new());
            let front = Front { pivots, border, children, first, runs, is_heavy: false };
            for &child in &front.children {
                fronts[child as usize].runs = runs_of(&fronts[child as usize].border, &front);
            }
            fronts.push(front);
        }
        let all = weights.last().map_or(0.0, |[all, _]| *all);
        for (front, [_, below]) in fronts.iter_mut().zip(&weights) {
            front.is_heavy = *below > HEAVY && PARTS * below > all;
        }
        Self { fronts, order, places, front_of }
    }

    /// Products and numbers of a factorisation with so many functions of each patch.
    pub(super) fn estimate(&self, functions: &impl Fn(u32) -> usize) -> [f64; 2] {
        let (mut products, mut numbers) = (0.0, 0.0);
        for front in &self.fronts {
            let of_places = |places: &mut dyn Iterator<Item = u32>| -> f64 {
                places.map(|place| functions(self.order[place as usize]) as f64).sum()
            };
            let p = of_places(&mut front.pivots.clone());
            let q = of_places(&mut front.border.iter().copied());
            products += p * (p * p / 3.0 + p * q + q * q);
            numbers += p * (p + q);
        }
        [products, numbers]
    }
}

/// How a border stands among the rows of a parent.
fn runs_of(border: &[u32], parent: &Front) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (number, place) in (0..).zip(border) {
        let row = parent.row(*place) as u32;
        match runs.last_mut() {
            Some(run) if run.place + run.border.len() as u32 == row => run.border.end += 1,
            _ => runs.push(Run { border: number..number + 1, place: row }),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::{Plan, Run};
    use crate::linalg::patches::{graph::Graph, tree::divide};

    #[test]
    fn borders_hold_what_is_changed_and_runs_lead_to_the_parent() {
        let meets = Graph::new(60, (0..59).map(|i| [i, i + 1]).chain((0..50).map(|i| [i, i + 10])));
        let centres: Vec<_> = (0..60).map(|i| [f64::from(i % 10), f64::from(i / 10), 0.0]).collect();
        let plan = Plan::new(&meets, &divide(&meets, &centres));
        let mut order = plan.order.clone();
        order.sort_unstable();
        assert_eq!(order, (0..60).collect::<Vec<u32>>());
        assert!(plan.fronts.last().is_some_and(|root| root.border.is_empty() && root.first == 0));

        for front in &plan.fronts {
            for place in front.pivots.clone() {
                let patch = plan.order[place as usize];
                assert_eq!(plan.places[patch as usize], place);
                let later = meets.of(patch).iter().map(|other| plan.places[*other as usize]);
                later.filter(|other| *other > place).for_each(|other| assert!(front.row(other) < 60));
            }
            for &child in &front.children {
                let child = &plan.fronts[child as usize];
                let mut covered = 0;
                for Run { border, place } in &child.runs {
                    assert_eq!(border.start, covered);
                    covered = border.end;
                    for (i, row) in border.clone().zip(*place as usize..) {
                        assert_eq!(front.row(child.border[i as usize]), row);
                    }
                }
                assert_eq!(covered as usize, child.border.len());
            }
        }
    }
}
