//! The levels of a coarse space: aggregates of one size, which of them meet, and which make one of the next level.

use std::{collections::BTreeSet, ops::Range};

use super::{
    affine::{Interpolation, Moments},
    group::group,
};
use crate::parallel::Own;

/// Aggregates that the factored level has, at most: nine unknowns each.
const LARGEST_TOP: usize = 33;
/// Aggregates of one level that make one of the next, as a rule.
const PER_PARENT: usize = 4;
/// Aggregates that a thread takes, at least.
pub(super) const LEAST_PIECE: usize = 32;

/// Aggregates of one size.
#[derive(Clone, Debug)]
pub(super) struct LevelLayout {
    /// First neighbour of each aggregate, and one more.
    pub(super) starts: Vec<usize>,
    /// Neighbours in ascending order, itself among them.
    pub(super) columns: Vec<u32>,
    /// The aggregate of the next level that each is in, and how functions of that one look on it; none at the last level.
    pub(super) parents: Vec<u32>,
    pub(super) interpolations: Vec<Interpolation>,
    /// Those that each aggregate is made of, in ascending order: first, and one more; none at the first level.
    pub(super) first_children: Vec<usize>,
    pub(super) children: Vec<u32>,
}

/// The aggregates of a level that are worked on here.
#[derive(Clone, Debug)]
pub(super) struct Reach<'a> {
    /// Those whose rows are known.
    pub(super) own: Range<usize>,
    /// Others that these are joined to, of which diagonal blocks and right-hand sides are known.
    pub(super) near: &'a [u32],
}

impl Reach<'_> {
    /// All of a level.
    pub(super) fn whole(level: &LevelLayout) -> Self {
        Self { own: 0..level.len(), near: &[] }
    }

    /// Own ones, for threads to share.
    pub(super) fn each_own(&self) -> Own {
        Own::of(self.own.clone(), 1).in_pieces_of(LEAST_PIECE)
    }
}

/// Levels from the aggregates of the finest on.
pub(super) fn levels(mut neighbours: Vec<BTreeSet<u32>>, mut moments: Vec<Moments>) -> Vec<LevelLayout> {
    let mut levels = vec![LevelLayout::new(&neighbours)];
    while moments.len() > LARGEST_TOP {
        let is_empty: Vec<bool> = moments.iter().map(Moments::is_empty).collect();
        // Few enough, but for those that are empty: these are left out, and nothing else changes.
        let is_small = is_empty.iter().filter(|is_empty| !**is_empty).count() <= LARGEST_TOP;
        let children = group(&neighbours, &is_empty, if is_small { 1 } else { PER_PARENT });
        let join = |parts: &Vec<u32>| {
            let mut parts = parts.iter().map(|part| moments[*part as usize]);
            let first = parts.next().expect("an aggregate has a part");
            parts.fold(first, Moments::and)
        };
        let of_parents: Vec<Moments> = children.iter().map(join).collect();
        let mut parents = vec![0; moments.len()];
        for (parent, parts) in (0..).zip(&children) {
            for part in parts {
                parents[*part as usize] = parent;
            }
        }
        let axes: Vec<_> = of_parents.iter().map(Moments::axes).collect();
        let interpolations = moments
            .iter()
            .zip(&parents)
            .map(|(part, parent)| part.interpolation(&part.axes(), &axes[*parent as usize]))
            .collect();
        neighbours = children
            .iter()
            .map(|parts| {
                let others = parts.iter().flat_map(|part| &neighbours[*part as usize]);
                others.map(|other| parents[*other as usize]).collect()
            })
            .collect();
        let last = levels.last_mut().expect("one or more");
        (last.parents, last.interpolations) = (parents, interpolations);
        levels.push(LevelLayout::new(&neighbours));
        let last = levels.last_mut().expect("one or more");
        for parts in &children {
            last.children.extend(parts);
            last.first_children.push(last.children.len());
        }
        moments = of_parents;
    }
    levels
}

impl LevelLayout {
    fn new(neighbours: &[BTreeSet<u32>]) -> Self {
        let (mut starts, mut columns) = (vec![0], Vec::new());
        for of_one in neighbours {
            columns.extend(of_one);
            starts.push(columns.len());
        }
        let (parents, interpolations, children) = (Vec::new(), Vec::new(), Vec::new());
        Self { starts, columns, parents, interpolations, first_children: vec![0], children }
    }

    /// Number of aggregates.
    pub(super) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Blocks of an aggregate's row.
    pub(super) fn row(&self, aggregate: usize) -> Range<usize> {
        self.starts[aggregate]..self.starts[aggregate + 1]
    }

    /// Blocks of the rows of some aggregates.
    pub(super) fn rows(&self, aggregates: Range<usize>) -> Range<usize> {
        self.starts[aggregates.start]..self.starts[aggregates.end]
    }

    /// The block of an aggregate itself.
    pub(super) fn diagonal(&self, aggregate: usize) -> usize {
        let row = self.row(aggregate);
        let place = self.columns[row.clone()].binary_search(&(aggregate as u32));
        row.start + place.expect("every aggregate is its own neighbour")
    }

    /// The aggregates of the level before that one is made of.
    pub(super) fn children(&self, aggregate: usize) -> &[u32] {
        &self.children[self.first_children[aggregate]..self.first_children[aggregate + 1]]
    }
}
