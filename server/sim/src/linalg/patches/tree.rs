//! In which order patches are eliminated: a tree of fronts by bisection of where they begin.

use super::graph::Graph;
use crate::interrupt;

/// Patches of a front that is divided no further, at most.
const LEAF: usize = 5;

/// Patches that are eliminated together, after those of the fronts that it follows.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Division {
    /// The patches; none where two halves do not meet.
    pub(super) pivots: Vec<u32>,
    /// Fronts before it whose patches do not meet, two at most.
    pub(super) children: Vec<u32>,
}

/// Fronts, each after its children; the last one is the root. None without patches.
///
/// Each part is divided where half of the centres lie along its longest axis; the smaller of the two borders of the halves
/// separates them (George 1973, by coordinates).
pub(super) fn divide(meets: &Graph, centres: &[[f64; 3]]) -> Vec<Division> {
    let mut work = Work { meets, centres, side: vec![0; meets.len()], fronts: Vec::new() };
    if meets.len() > 0 {
        work.divide((0..meets.len() as u32).collect());
    }
    work.fronts
}

struct Work<'a> {
    meets: &'a Graph,
    centres: &'a [[f64; 3]],
    /// 1 and 2 in the halves of what is divided now, 0 elsewhere.
    side: Vec<u8>,
    fronts: Vec<Division>,
}

impl Work<'_> {
    /// The front of some patches, which is told last.
    fn divide(&mut self, mut patches: Vec<u32>) -> u32 {
        interrupt::point();
        if patches.len() <= LEAF {
            return self.push(patches, Vec::new());
        }
        let axis = self.longest_axis(&patches);
        let at = |patch: &u32| self.centres[*patch as usize][axis];
        patches.sort_by(|a, b| at(a).total_cmp(&at(b)).then(a.cmp(b)));
        let right = patches.split_off(patches.len() / 2);
        let mut halves = [patches, right];
        self.mark(&halves, [1, 2]);
        let borders = [self.border(&halves[0], 2), self.border(&halves[1], 1)];
        self.mark(&halves, [0, 0]);

        let smaller = usize::from(borders[1].len() < borders[0].len());
        let [first, second] = borders;
        let pivots = if smaller == 0 { first } else { second };
        halves[smaller].retain(|patch| !pivots.contains(patch));
        let mut children = Vec::new();
        for half in halves {
            if !half.is_empty() {
                children.push(self.divide(half));
            }
        }
        self.push(pivots, children)
    }

    fn push(&mut self, pivots: Vec<u32>, children: Vec<u32>) -> u32 {
        self.fronts.push(Division { pivots, children });
        self.fronts.len() as u32 - 1
    }

    fn longest_axis(&self, patches: &[u32]) -> usize {
        let extent = |axis: usize| {
            let along = patches.iter().map(|patch| self.centres[*patch as usize][axis]);
            let (low, high) =
                along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
            high - low
        };
        let extents = [extent(0), extent(1), extent(2)];
        let longer = |best: usize, axis: usize| if extents[axis] > extents[best] { axis } else { best };
        longer(longer(0, 1), 2)
    }

    fn mark(&mut self, halves: &[Vec<u32>; 2], sides: [u8; 2]) {
        for (half, side) in halves.iter().zip(sides) {
            for patch in half {
                self.side[*patch as usize] = side;
            }
        }
    }

    /// Those of a half that meet the other one.
    fn border(&self, half: &[u32], other: u8) -> Vec<u32> {
        let is_other = |near: &u32| self.side[*near as usize] == other;
        let meets = |patch: &&u32| self.meets.of(**patch).iter().any(is_other);
        half.iter().filter(meets).copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::{Division, LEAF, divide};
    use crate::linalg::patches::graph::Graph;

    /// Fronts are checked: every patch once, children before parents, siblings apart.
    fn check(meets: &Graph, fronts: &[Division]) {
        let mut below = vec![Vec::new(); fronts.len()];
        let mut seen = vec![0; meets.len()];
        for (number, front) in fronts.iter().enumerate() {
            let mut parts = Vec::new();
            for &child in &front.children {
                assert!((child as usize) < number);
                parts.push(std::mem::take(&mut below[child as usize]));
            }
            if let [left, right] = &parts[..] {
                let apart = |i: &u32| meets.of(*i).iter().all(|j| !right.contains(j));
                assert!(left.iter().all(apart), "siblings do not meet");
            }
            front.pivots.iter().for_each(|patch| seen[*patch as usize] += 1);
            below[number] = parts.concat();
            below[number].extend(&front.pivots);
        }
        assert!(seen.iter().all(|times| *times == 1), "{seen:?}");
    }

    #[test]
    fn halves_are_apart_and_everyone_is_eliminated_once() {
        let side = 13_u32;
        let pairs = (0..side * side).flat_map(|i| {
            let (x, y) = (i % side, i / side);
            let near = [(x + 1, y), (x, y + 1), (x + 1, y + 1)];
            near.into_iter().filter(|(x, y)| *x < side && *y < side).map(move |(x, y)| [i, y * side + x])
        });
        let meets = Graph::new((side * side) as usize, pairs);
        let centres: Vec<_> =
            (0..side * side).map(|i| [f64::from(i % side), 0.0, f64::from(i / side)]).collect();
        let fronts = divide(&meets, &centres);
        check(&meets, &fronts);
        assert!(fronts.iter().all(|front| front.children.len() <= 2));
        let mut leaves = fronts.iter().filter(|front| front.children.is_empty());
        assert!(leaves.all(|leaf| leaf.pivots.len() <= LEAF));
        assert!(fronts.last().is_some_and(|root| (1..=20).contains(&root.pivots.len())));
    }

    #[test]
    fn places_that_coincide_and_patches_that_do_not_meet_are_divided() {
        for pairs in [Vec::new(), (0..39).map(|i| [i, i + 1]).collect(), (1..40).map(|i| [0, i]).collect()] {
            let meets = Graph::new(40, pairs.into_iter());
            check(&meets, &divide(&meets, &[[1.0; 3]; 40]));
        }
        assert!(divide(&Graph::new(0, std::iter::empty()), &[]).is_empty());
        let one = Division { pivots: vec![0], children: Vec::new() };
        assert_eq!(divide(&Graph::new(1, std::iter::empty()), &[[0.0; 3]]), [one]);
    }
}
