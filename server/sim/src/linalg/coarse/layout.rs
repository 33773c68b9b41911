//! What of a coarse space follows from the body as it begins: aggregates of rows, functions on them, and which
//! aggregates meet.

use std::{collections::BTreeSet, ops::Range};

use super::{
    affine::{Interpolation, Moments},
    group::group,
    parts::{Links, MOST, parts_of_blocks},
    transfer::RowFunctions,
};
use crate::{
    interrupt,
    math::{LANES, Vec3, vec3},
};

/// Aggregates that the factored level has, at most: nine unknowns each.
const LARGEST_TOP: usize = 33;
/// Neighbours of the aggregates of a block together, at most on average: of a sheet there are eight, and ten times as many
/// where layers lie on each other, which then are fewer blocks.
const MOST_NEIGHBOURS: usize = 64;
/// Aggregates of one level that make one of the next, as a rule.
const PER_PARENT: usize = 4;

/// The functions and the aggregates of a coarse space.
#[derive(Clone, Debug)]
pub struct CoarseLayout {
    /// By sixteens of rows.
    basis: Vec<RowFunctions>,
    block_size: usize,
    /// Aggregates of each block; some may be empty.
    per_block: usize,
    /// First neighbour of the first aggregate of each block, and one more.
    block_starts: Vec<usize>,
    /// The finest first, at least one.
    pub(super) levels: Vec<LevelLayout>,
}

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

impl CoarseLayout {
    /// Aggregates of a block, at most.
    pub(crate) const MOST_PER_BLOCK: usize = MOST;

    /// From the place (m) of each row as the body begins and whether it may change, in blocks of a size; and pairs of rows
    /// that the matrix joins.
    ///
    /// # Errors
    /// When pairs join so many aggregates to others that the coarse matrix would be larger than what it is made for.
    pub fn new(
        rest: &[[f64; 3]],
        is_free: &[bool],
        block_size: usize,
        pairs: impl Iterator<Item = [u32; 2]> + Clone,
    ) -> Result<Self, String> {
        let links = Links::within_blocks(rest.len(), block_size, pairs.clone());
        let parts = parts_of_blocks(rest, block_size, &links);
        let per_block = 1 + parts.iter().copied().max().map_or(0, usize::from);
        let blocks = rest.len().div_ceil(block_size);
        let aggregate =
            |row: u32| row / block_size as u32 * per_block as u32 + u32::from(parts[row as usize]);

        let mut rows_of = vec![Vec::new(); blocks * per_block];
        for (row, _) in (0_u32..).zip(is_free).filter(|(_, is_free)| **is_free) {
            interrupt::point();
            rows_of[aggregate(row) as usize].push(row);
        }
        let at = |row: &u32| vec3(rest[*row as usize]);
        let moments: Vec<Moments> = rows_of.iter().map(|rows| Moments::of(rows.iter().map(at))).collect();
        let most = MOST_NEIGHBOURS * blocks.max(MOST_NEIGHBOURS);
        let neighbours = neighbours(moments.len(), most, pairs.map(|pair| pair.map(aggregate)))?;

        let mut basis = vec![RowFunctions::default(); rest.len().div_ceil(LANES)];
        for (number, (rows, moments)) in rows_of.iter().zip(&moments).enumerate() {
            let axes = moments.axes();
            for &row in rows {
                let (row, x): (usize, Vec3<f64>) = (row as usize, vec3(rest[row as usize]));
                basis[row / LANES].set(row % LANES, axes.at(x), (number % per_block) as u8);
            }
        }
        for (row, part) in parts.iter().enumerate() {
            basis[row / LANES].parts[row % LANES] = *part;
        }
        let levels = levels(neighbours, moments);
        let block_starts = levels[0].starts.iter().copied().step_by(per_block).collect();
        Ok(Self { basis, block_size, per_block, block_starts, levels })
    }

    /// The functions on sixteens of rows of a block.
    pub(super) fn basis(&self, block: usize, sixteens: usize) -> &[RowFunctions] {
        let first = block * (self.block_size / LANES);
        &self.basis[first..first + sixteens]
    }

    /// First neighbour of the first aggregate of each block, and one more.
    pub(super) fn block_starts(&self) -> &[usize] {
        &self.block_starts
    }

    /// Where the neighbours of an aggregate begin among those of its block.
    #[inline(always)]
    fn offset(&self, aggregate: usize) -> usize {
        self.levels[0].starts[aggregate] - self.block_starts[aggregate / self.per_block]
    }

    /// Which of the blocks of a block of rows joins an aggregate to another, if one does.
    #[inline(always)]
    pub(crate) fn find(&self, aggregate: usize, other: usize) -> Option<usize> {
        let level = &self.levels[0];
        let place = level.columns[level.row(aggregate)].binary_search(&(other as u32)).ok()?;
        Some(self.offset(aggregate) + place)
    }

    /// The block of a block of rows that joins an aggregate to another.
    ///
    /// # Panics
    /// Where no pair of the layout joins them.
    #[inline(always)]
    pub(crate) fn place(&self, aggregate: usize, other: usize) -> usize {
        self.find(aggregate, other).expect("the layout holds every pair")
    }

    /// Aggregates of each block.
    pub(crate) fn per_block(&self) -> usize {
        self.per_block
    }

    /// Number of aggregates.
    #[cfg(test)]
    pub(crate) fn len(&self) -> usize {
        self.levels[0].len()
    }

    /// The aggregate of a row.
    #[inline(always)]
    pub(crate) fn aggregate(&self, row: usize) -> usize {
        row / self.block_size * self.per_block + self.part(row)
    }

    /// Which of its block's aggregates a row is in.
    #[inline(always)]
    pub(crate) fn part(&self, row: usize) -> usize {
        usize::from(self.basis[row / LANES].parts[row % LANES])
    }

    /// 1, u and v in a row.
    #[inline(always)]
    pub(crate) fn at(&self, row: usize) -> [f64; 3] {
        self.basis[row / LANES].at(row % LANES)
    }

    /// Aggregates that the matrix joins to one, in ascending order, itself among them; of all of a block one after another.
    #[cfg(test)]
    pub(crate) fn neighbours(&self, block: usize) -> &[u32] {
        &self.levels[0].columns[self.block_starts[block]..self.block_starts[block + 1]]
    }
}

/// Aggregates that pairs join, each its own neighbour too.
fn neighbours(
    count: usize,
    most: usize,
    pairs: impl Iterator<Item = [u32; 2]>,
) -> Result<Vec<BTreeSet<u32>>, String> {
    let mut neighbours: Vec<BTreeSet<u32>> = (0..count as u32).map(|i| [i].into()).collect();
    let mut joined = 0;
    for [i, j] in pairs {
        interrupt::point();
        if i != j && neighbours[i as usize].insert(j) {
            neighbours[j as usize].insert(i);
            joined += 2;
        }
        if joined > most {
            return Err(format!(
                "springs or elements join parts of its blocks of particles to more than {MOST_NEIGHBOURS} others per \
                 block: too entangled for the preconditioner two_level"
            ));
        }
    }
    Ok(neighbours)
}

/// Levels from the aggregates of the finest on.
fn levels(mut neighbours: Vec<BTreeSet<u32>>, mut moments: Vec<Moments>) -> Vec<LevelLayout> {
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
