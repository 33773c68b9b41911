//! The sparse grid: blocks that hold particles, the blocks of nodes around, and what lies on them.
//!
//! Blocks are kept sorted by key; nothing else is stored or visited.

use std::ops::Range;

use super::{
    block_keys::{find_neighbors, step_of, unite},
    blocks::{CELLS, NONE, NodeBlock, block_of, corner, key_of, shifted, tile_len},
};
use crate::{math::Real, snow::settings::Forces};

/// Blocks, sorted by key.
#[derive(Clone, Debug)]
pub(crate) struct Grid<R> {
    /// Blocks with particles.
    pub(crate) blocks: Vec<u64>,
    /// Blocks with nodes that particles reach.
    pub(crate) node_blocks: Vec<u64>,
    /// For each block with particles, the eight blocks of nodes in front of it.
    pub(crate) in_front: Vec<[u32; 8]>,
    /// For each block of nodes, the eight blocks with particles behind it.
    pub(crate) behind: Vec<[u32; 8]>,
    /// What the particles of each block give to nodes: momentum and mass.
    pub(crate) tiles: Vec<R>,
    /// Impulses of forces alone, where velocities before forces are needed.
    pub(crate) impulses: Vec<R>,
    /// Blocks with particles of other ranks, sorted: their tiles lie behind those of own ones.
    pub(crate) others: Vec<u64>,
    /// Keys of the blocks that are this rank's, with or without particles; all where there are no others.
    pub(crate) own_keys: Range<u64>,
    /// Which of the blocks of nodes are this rank's.
    pub(crate) own_nodes: Range<usize>,
    /// Blocks of nodes, while they are being found.
    spare_blocks: Vec<u64>,
    /// For each block of nodes, the eight blocks of others behind it, while they are being found.
    behind_others: Vec<[u32; 8]>,
    /// Velocities after forces and colliders, and masses.
    pub(crate) nodes: Vec<NodeBlock<R>>,
    /// Blocks that `nodes` lie on: those of the last step, whose particles may have moved to others since.
    pub(crate) written_blocks: Vec<u64>,
    /// Changes of velocity in this step, for FLIP.
    pub(crate) changes: Vec<NodeBlock<R>>,
}

impl<R> Default for Grid<R> {
    fn default() -> Self {
        Self {
            blocks: Vec::new(),
            node_blocks: Vec::new(),
            in_front: Vec::new(),
            behind: Vec::new(),
            tiles: Vec::new(),
            impulses: Vec::new(),
            others: Vec::new(),
            own_keys: 0..u64::MAX,
            own_nodes: 0..0,
            spare_blocks: Vec::new(),
            behind_others: Vec::new(),
            nodes: Vec::new(),
            written_blocks: Vec::new(),
            changes: Vec::new(),
        }
    }
}

impl<R: Real> Grid<R> {
    /// Finds the blocks of nodes around `self.blocks` and links both.
    pub(crate) fn link(&mut self, periodic: [u32; 3]) {
        self.find_node_blocks(periodic);
        if !self.others.is_empty() {
            self.add_nodes_of_others(periodic);
        }
        let Self {
            blocks, node_blocks, in_front, behind, others, own_keys, own_nodes, behind_others, ..
        } = self;
        let place = |key: u64| node_blocks.partition_point(|other| *other < key);
        *own_nodes = place(own_keys.start)..place(own_keys.end);

        in_front.resize(blocks.len(), [NONE; 8]);
        find_neighbors(blocks, node_blocks, in_front, corner, periodic);
        behind.resize(node_blocks.len(), [NONE; 8]);
        let back = |i: usize| corner(i).map(|c| -c);
        find_neighbors(node_blocks, blocks, behind, back, periodic);
        if !others.is_empty() {
            behind_others.resize(node_blocks.len(), [NONE; 8]);
            find_neighbors(node_blocks, others, behind_others, back, periodic);
            for (own, other) in behind.as_flattened_mut().iter_mut().zip(behind_others.as_flattened()) {
                if *other != NONE {
                    *own = blocks.len() as u32 + other;
                }
            }
        }
    }

    /// Adds own blocks in front of those of others.
    fn add_nodes_of_others(&mut self, periodic: [u32; 3]) {
        let Self { others, own_keys, node_blocks, .. } = self;
        for key in others.iter() {
            let in_front = (0..8).map(|i| key_of(shifted(block_of(*key), corner(i), periodic)));
            node_blocks.extend(in_front.filter(|key| own_keys.contains(key)));
        }
        node_blocks.sort_unstable();
        node_blocks.dedup();
    }

    /// The blocks in front of every block, sorted.
    fn find_node_blocks(&mut self, periodic: [u32; 3]) {
        let Self { blocks, node_blocks, spare_blocks, .. } = self;
        if periodic == [0; 3] {
            // With the next one along z, then along y, then along x: every sum of such steps.
            let next = |blocks: &[u64], by, out: &mut Vec<u64>| {
                let step = step_of(by);
                unite(blocks.iter().copied(), blocks.iter().map(|key| key.wrapping_add(step)), out);
            };
            next(blocks, [0, 0, 1], node_blocks);
            next(node_blocks, [0, 1, 0], spare_blocks);
            next(spare_blocks, [1, 0, 0], node_blocks);
            return;
        }

        node_blocks.clear();
        for &key in blocks.iter() {
            let block = block_of(key);
            node_blocks.extend((0..8).map(|i| key_of(shifted(block, corner(i), periodic))));
        }

        node_blocks.sort_unstable();
        node_blocks.dedup();
    }

    /// Room for the tiles of a kernel of width `n`; never shrinks.
    pub(crate) fn size_for(&mut self, n: usize, separate: Forces) {
        let blocks = self.blocks.len() + self.others.len();
        let (node_blocks, tile) = (self.node_blocks.len(), tile_len(n));
        grow(&mut self.tiles, [blocks, tile], R::zero());
        grow(&mut self.nodes, [node_blocks, 1], [[R::zero(); 4]; CELLS]);
        // As many keys as there are nodes to have one.
        self.written_blocks.reserve_exact(self.nodes.len().saturating_sub(self.written_blocks.len()));
        if separate == Forces::Apart {
            grow(&mut self.impulses, [blocks, tile], R::zero());
            grow(&mut self.changes, [node_blocks, 1], [[R::zero(); 4]; CELLS]);
        }
    }

    /// The same blocks, linked alike, with nothing on them.
    pub(crate) fn bare(&self) -> Self {
        Self {
            blocks: self.blocks.clone(),
            node_blocks: self.node_blocks.clone(),
            in_front: self.in_front.clone(),
            behind: self.behind.clone(),
            own_nodes: self.own_nodes.clone(),
            ..Self::default()
        }
    }

    /// Room for more blocks than there are, so that a moving front seldom allocates.
    pub(crate) fn reserve(&mut self, blocks: usize) {
        self.blocks.reserve(blocks);
        self.in_front.reserve(blocks);
        self.node_blocks.reserve(8 * blocks);
        self.spare_blocks.reserve(8 * blocks);
        self.behind.reserve(8 * blocks);
    }

    /// Bytes in use.
    pub(crate) fn bytes(&self) -> usize {
        let keys = [&self.blocks, &self.node_blocks, &self.spare_blocks, &self.written_blocks];
        keys.map(Vec::capacity).iter().sum::<usize>() * 8
            + (self.in_front.capacity() + self.behind.capacity() + self.behind_others.capacity()) * 32
            + (self.tiles.capacity() + self.impulses.capacity()) * size_of::<R>()
            + (self.nodes.capacity() + self.changes.capacity()) * size_of::<NodeBlock<R>>()
    }
}

/// Blocks that there is room for on top of those in use: even a few may soon be several times as many.
pub(crate) const ROOM: usize = 64;

/// Makes a field of `blocks` of `each` elements long enough, with some room so that a moving front
/// seldom allocates.
fn grow<T: Copy>(field: &mut Vec<T>, [blocks, each]: [usize; 2], value: T) {
    if field.len() < blocks * each {
        let length = (blocks + blocks / 8 + ROOM) * each;
        field.reserve_exact(length - field.len());
        field.resize(length, value);
    }
}
