//! The search for triangles whose boxes meet, from every block of a tree, until it is broken off.
//!
//! Reads the boxes of each level; calls what is done with a triangle and some of those that it meets. Where all overlap, looks grow as the
//! square of their number: whoever asked for them can end them, or have them given up, after a few hundred.

use std::{
    ops::ControlFlow,
    sync::atomic::{AtomicUsize, Ordering},
};

use super::bounds::{Bounds, Four, WIDTH};
use crate::{
    interrupt::{Interrupt, Interrupted},
    parallel::{Own, per_block_mut},
};

/// Levels that every tree has: a block of triangles has a node of its own.
pub(super) const LEAST_LEVELS: usize = 3;
/// Triangles that are searched from at once: those of a node of the third level.
pub(super) const BLOCK: usize = WIDTH * WIDTH * WIDTH;
/// Triangles that one is looked at with before it is asked whether to go on.
const GO: usize = 256;
/// Nodes, or triangles, that a block keeps room for from one search to the next: where all overlap, each finds all of them.
const ROOM: usize = 1024;

/// Nodes that may have something for what is searched from.
#[derive(Clone, Debug, Default)]
pub(super) struct Search {
    /// Level and number of those that wait to be looked at.
    waiting: Vec<(usize, usize)>,
    /// Those of 64 triangles for as many, then those of 16 for as many, then those of 4 for as many.
    near: [Vec<usize>; LEAST_LEVELS],
    partners: Vec<usize>,
}

/// Searches from all blocks; gives the first one that was broken off. Those before it are whole, whatever the number of threads.
pub(super) fn search<T: Send>(
    (levels, faces): (&[Vec<Four>], usize),
    searches: &mut [Search],
    left: &mut [T],
    interrupt: &Interrupt,
    each: impl Fn(&mut T, usize, &[usize]) -> ControlFlow<()> + Sync,
) -> Result<Option<usize>, Interrupted> {
    let blocks = searches.len();
    let first = AtomicUsize::new(blocks);
    let fields = (per_block_mut(left), per_block_mut(searches));
    Own::whole(blocks, 1).each(fields, |block, (left, search)| {
        let is_over = || interrupt.is_requested() || first.load(Ordering::Relaxed) < block;
        if is_over() {
            return;
        }
        let ended = search.partners(levels, faces, block, |face, partners| {
            if is_over() { ControlFlow::Break(()) } else { each(left, face, partners) }
        });
        if ended.is_break() {
            first.fetch_min(block, Ordering::Relaxed);
        }
        search.let_go();
    });

    if interrupt.is_requested() {
        return Err(Interrupted);
    }
    let first = first.into_inner();
    Ok((first < blocks).then_some(first))
}

impl Search {
    /// Calls `each` for the triangles of a block with those of greater number whose boxes meet theirs, ascending and some at a
    /// time, until it breaks off.
    fn partners(
        &mut self,
        levels: &[Vec<Four>],
        faces: usize,
        block: usize,
        mut each: impl FnMut(usize, &[usize]) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.descend(levels, block);
        let Self { near: [by_64, by_16, by_4], partners, .. } = self;
        for p in WIDTH * block..levels[1].len().min(WIDTH * (block + 1)) {
            meet(&levels[2], by_64, &levels[2][block].get(p % WIDTH), p, by_16);
            for f in WIDTH * p..levels[0].len().min(WIDTH * (p + 1)) {
                meet(&levels[1], by_16, &levels[1][p].get(f % WIDTH), f, by_4);
                for face in WIDTH * f..faces.min(WIDTH * (f + 1)) {
                    meet(&levels[0], by_4, &levels[0][f].get(face % WIDTH), face + 1, partners);
                    for partners in partners.chunks(GO) {
                        each(face, partners)?;
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Lets room go of which others have no need.
    fn let_go(&mut self) {
        let Self { near, partners, .. } = self;
        for list in near.iter_mut().chain([partners]).filter(|list| list.capacity() > ROOM) {
            *list = Vec::new();
        }
    }

    /// Finds the nodes of 64 triangles whose boxes meet that of a block, from its own on.
    fn descend(&mut self, levels: &[Vec<Four>], block: usize) {
        let Self { waiting, near: [by_64, ..], .. } = self;
        by_64.clear();
        let last = LEAST_LEVELS - 1;
        let own = levels[last][block].all();
        waiting.push((levels.len() - 1, 0));
        while let Some((level, node)) = waiting.pop() {
            if level == last {
                by_64.push(node);
                continue;
            }
            let met = levels[level][node].met_by(&own);
            for lane in (0..WIDTH).rev().filter(|lane| (met >> lane) & 1 == 1) {
                let child = WIDTH * node + lane;
                let end = (child + 1) << (2 * (level - LEAST_LEVELS));
                if end > block {
                    waiting.push((level - 1, child));
                }
            }
        }
    }
}

/// Of some nodes of a level, the children from `first` on whose boxes meet one.
#[inline(always)]
fn meet(level: &[Four], nodes: &[usize], bounds: &Bounds, first: usize, children: &mut Vec<usize>) {
    children.clear();
    for node in nodes {
        let mut met = level[*node].met_by(bounds);
        while met != 0 {
            let child = WIDTH * node + met.trailing_zeros() as usize;
            met &= met - 1;
            if child >= first {
                children.push(child);
            }
        }
    }
}
