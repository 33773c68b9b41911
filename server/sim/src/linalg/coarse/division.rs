//! How ranks share the work on a coarse space: the finest level is divided as the body is, and all others are alike on all.

use std::ops::Range;

use super::level::LevelLayout;
use crate::parallel::{Border, Share};

/// What a rank computes of the finest level, and what goes over the borders of that part.
#[derive(Debug)]
pub(super) struct Division {
    /// Aggregates of others that its own are joined to, ascending: it smooths them too.
    pub(super) near: Vec<u32>,
    /// What goes from aggregates to those of other ranks.
    pub(super) aggregates: Border,
    /// Of blocks of the matrix: diagonal ones of aggregates at the border, and rows of those whose parent another rank makes.
    pub(super) blocks: Border,
    /// The end of the aggregates of the second level that each rank makes: those whose first part is its own.
    parent_ends: Vec<usize>,
}

impl Division {
    /// That of a body with more than one level; none where one rank computes all, or all ranks are to do the same.
    pub(super) fn new(levels: &[LevelLayout], per_block: usize, share: &Share) -> Option<Self> {
        let ((ranks, rank), [finest, second, ..]) = (share.ranks()?, levels) else { return None };
        if !share.divides() {
            return None;
        }
        let owner = |aggregate: u32| share.owner(aggregate as usize / per_block);
        let maker = |parent: usize| owner(second.children(parent)[0]);
        let mut of_aggregates = vec![[Vec::new(), Vec::new()]; ranks.end];
        let mut of_blocks = of_aggregates.clone();
        for i in 0..finest.len() as u32 {
            let (from, row) = (owner(i), finest.row(i as usize));
            let makes = maker(finest.parents[i as usize] as usize);
            let joined = finest.columns[row.clone()].iter().map(|other| owner(*other));
            let mut send = |to: usize, blocks: Range<usize>, is_joined: bool| {
                let (other, side) = if from == rank { (to, 0) } else { (from, 1) };
                if to != from && (to == rank || from == rank) {
                    of_blocks[other][side].extend(blocks.map(|block| block as u32));
                    of_aggregates[other][side].extend(is_joined.then_some(i));
                }
            };
            let diagonal = finest.diagonal(i as usize);
            joined.for_each(|to| send(to, diagonal..diagonal + 1, true));
            send(makes, row, false);
        }
        let [aggregates, blocks] = [of_aggregates, of_blocks].map(Border::of);
        let mut near: Vec<u32> =
            aggregates.sides().flat_map(|(_, [_, received])| received).copied().collect();
        near.sort_unstable();
        let makers: Vec<usize> = (0..second.len()).map(maker).collect();
        let parent_ends = ranks.map(|rank| makers.partition_point(|maker| *maker <= rank)).collect();
        Some(Self { near, aggregates, blocks, parent_ends })
    }

    /// The aggregates of the second level that a rank makes.
    pub(super) fn parents_of(&self, rank: usize) -> Range<usize> {
        let start = if rank == 0 { 0 } else { self.parent_ends[rank - 1] };
        start..self.parent_ends[rank]
    }
}
