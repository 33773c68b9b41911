//! What of a coarse space follows from the body as it begins: aggregates of rows, functions on them, and which
//! aggregates meet.

use std::{collections::BTreeSet, ops::Range, sync::Arc};

use super::{
    affine::Moments,
    division::Division,
    level::{LevelLayout, Reach, levels},
    parts::{Links, MOST, parts_of_blocks},
    transfer::RowFunctions,
};
use crate::{
    interrupt,
    math::{LANES, Vec3, vec3},
    parallel::Share,
};

/// Neighbours of the aggregates of a block together, at most on average: of a sheet there are eight, and ten times as many
/// where layers lie on each other, which then are fewer blocks.
const MOST_NEIGHBOURS: usize = 64;
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
    /// The blocks of rows that are computed here.
    pub(super) share: Share,
    /// Where ranks divide the finest level.
    pub(super) division: Option<Arc<Division>>,
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
        let share = Share::whole(rest.len(), block_size);
        Ok(Self { basis, block_size, per_block, block_starts, levels, share, division: None })
    }

    /// The same for the blocks of rows of a share.
    pub(crate) fn over(mut self, share: &Share) -> Self {
        self.division = Division::new(&self.levels, self.per_block, share).map(Arc::new);
        self.share = share.clone();
        self
    }

    /// The aggregates of a rank.
    pub(super) fn aggregates_of(&self, rank: usize) -> Range<usize> {
        let blocks = self.share.blocks_of(rank);
        blocks.start * self.per_block..blocks.end * self.per_block
    }

    /// The blocks of the matrix in the rows of a rank.
    pub(super) fn entries_of(&self, rank: usize) -> Range<usize> {
        let blocks = self.share.blocks_of(rank);
        self.block_starts[blocks.start]..self.block_starts[blocks.end]
    }

    /// The number of this rank.
    pub(super) fn rank(&self) -> usize {
        self.share.ranks().map_or(0, |(_, rank)| rank)
    }

    /// The aggregates of the finest level that are worked on here.
    pub(super) fn reach(&self) -> Reach<'_> {
        match self.division.as_deref() {
            Some(division) => Reach { own: self.aggregates_of(self.rank()), near: &division.near },
            None => Reach::whole(&self.levels[0]),
        }
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
