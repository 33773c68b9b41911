//! Items of a few particles each, listed by block: a block works on every item that touches one of its rows, sixteen at a
//! time, and adds to its own rows in the order of the items.
//!
//! An item on a border is worked on by each block that it touches, so that nobody writes where another thread writes, and
//! the sum of a row depends on neither threads nor ranks.
#![allow(unsafe_code, reason = "lanes read particles whose range was checked when the items were listed")]

use std::ops::Range;

use super::halo::{HaloBuilder, Halos};
use crate::{
    interrupt,
    math::{LANES, Pack, Record},
};

/// Items of `N` particles, in packs of sixteen.
#[derive(Clone, Debug)]
pub(super) struct Lists<const N: usize> {
    /// Particles of the items of a pack, as their block names them.
    pub(super) particles: Vec<[[u16; LANES]; N]>,
    /// Items in each pack: the lanes from the first.
    pub(super) used: Vec<u8>,
    /// First pack of each block, and one more.
    blocks: Vec<u32>,
    pub(super) halos: Halos,
    pub(super) block_size: usize,
}

impl<const N: usize> Lists<N> {
    /// Lists items by block, each in every block that it touches; `place` gives the model's numbering. Tells of each pack
    /// which item each lane has: those without one repeat the first, and what they come to is not added.
    pub(super) fn new(
        items: &[[u32; N]],
        block_size: usize,
        place: &[u32],
        tell: &mut dyn FnMut(&[usize; LANES]),
    ) -> Self {
        let mut of_block: Vec<Vec<u32>> = vec![Vec::new(); place.len().div_ceil(block_size)];
        for (item, particles) in (0u32..).zip(items) {
            interrupt::point();
            for particle in particles {
                let listed = &mut of_block[place[*particle as usize] as usize / block_size];
                if listed.last() != Some(&item) {
                    listed.push(item);
                }
            }
        }

        let mut halos = HaloBuilder::new(place.len(), block_size);
        let (mut names, mut used, mut blocks) = (Vec::new(), Vec::new(), vec![0]);
        for listed in &of_block {
            halos.begin_block();
            for pack in listed.chunks(LANES) {
                interrupt::point();
                let of_lanes: [usize; LANES] =
                    std::array::from_fn(|lane| pack[if lane < pack.len() { lane } else { 0 }] as usize);
                let named: [[u32; LANES]; N] =
                    std::array::from_fn(|corner| of_lanes.map(|item| place[items[item][corner] as usize]));
                let mut local = [[0; LANES]; N];
                halos.item(named.as_flattened(), local.as_flattened_mut());
                names.push(local);
                used.push(pack.len() as u8);
                tell(&of_lanes);
            }
            halos.end_block();
            blocks.push(names.len() as u32);
        }
        Self { particles: names, used, blocks, halos: halos.finish(), block_size }
    }

    /// Packs of a block.
    pub(super) fn packs(&self, block: usize) -> Range<usize> {
        self.blocks[block] as usize..self.blocks[block + 1] as usize
    }

    /// Records that a block copies, at most.
    pub(super) fn room(&self) -> usize {
        self.halos.room()
    }

    /// Both vectors of the particles of a pack, from as many records as there is room for.
    #[inline(always)]
    pub(super) fn gather<P: Pack>(
        &self,
        pack: usize,
        records: &[Record<P::Number>],
    ) -> ([[P; 3]; N], [[P; 3]; N]) {
        let (mut x, mut y) = ([[P::zero(); 3]; N], [[P::zero(); 3]; N]);
        for corner in 0..N {
            // SAFETY: `new` names particles of the block and of the part of its halo that the pack is in: fewer than
            // `room`, which is no more than there are records.
            [x[corner], y[corner]] = unsafe { P::gather(records, &self.particles[pack][corner]) };
        }
        (x, y)
    }

    /// Whether an item of a pack has a particle in a group of rows.
    #[inline(always)]
    pub(super) fn touches(&self, pack: usize, group: usize) -> bool {
        self.particles[pack].as_flattened().iter().any(|name| usize::from(*name) / LANES == group)
    }

    /// Names of a pack's items at a corner.
    #[inline(always)]
    pub(super) fn names(&self, pack: usize, corner: usize) -> &[u16] {
        &self.particles[pack][corner][..usize::from(self.used[pack])]
    }

    /// Items that touch a row: pack, lane, and the corner that the row is.
    pub(super) fn touching(&self, row: usize) -> impl Iterator<Item = (usize, usize, usize)> {
        let own = (row % self.block_size) as u16;
        let packs = self.packs(row / self.block_size);
        packs.flat_map(move |pack| {
            (0..N).flat_map(move |corner| {
                let names = self.names(pack, corner).iter().enumerate();
                names.filter(move |(_, name)| **name == own).map(move |(lane, _)| (pack, lane, corner))
            })
        })
    }

    /// The particle at a corner of an item in the block of a row.
    pub(super) fn particle(&self, row: usize, pack: usize, [corner, lane]: [usize; 2]) -> u32 {
        self.halos.particle(row / self.block_size, pack, self.particles[pack][corner][lane])
    }
}
