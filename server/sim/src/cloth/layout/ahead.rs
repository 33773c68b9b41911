//! What the next block will read, asked for while a block is computed: its own particles and the first part of its halo.
//!
//! A block copies them before it computes, and would wait for memory meanwhile. Blocks of a thread follow one another.

use std::ops::Range;

use super::halo::Halos;
use crate::math::{LANES, Padded, Real, prefetch};

/// Particles of the next block that are still to be asked for.
pub(super) struct Ahead<'a> {
    own: Range<usize>,
    halo: &'a [u32],
    /// How many of the halo with each group of rows.
    each: usize,
}

impl<'a> Ahead<'a> {
    /// What the block behind `block` reads; nothing behind the last.
    #[inline(always)]
    pub(super) fn of(halos: &'a Halos, block: usize, block_size: usize) -> Self {
        let Some((halo, _)) = halos.parts_of(block + 1).and_then(|mut parts| parts.next()) else {
            return Self { own: 0..0, halo: &[], each: 0 };
        };
        let (first, groups) = ((block + 1) * block_size, block_size / LANES);
        let halo = halo.particles();
        Self { own: first..first + block_size, halo, each: halo.len().div_ceil(groups) }
    }

    /// Asks for as much as one of a block's groups has time for.
    #[inline(always)]
    pub(super) fn ask<R: Real>(&mut self, [x, y]: [&[Padded<R>]; 2]) {
        const { assert!(LINE.is_multiple_of(size_of::<Padded<R>>())) };
        let (now, later) = self.halo.split_at(self.each.min(self.halo.len()));
        self.halo = later;
        for &particle in now {
            prefetch(x, particle as usize);
            prefetch(y, particle as usize);
        }

        let end = self.own.end.min(self.own.start + LANES);
        for particle in (self.own.start..end).step_by(LINE / size_of::<Padded<R>>()) {
            prefetch(x, particle);
            prefetch(y, particle);
        }
        self.own.start = end;
    }
}

/// Bytes that memory hands over at a time.
const LINE: usize = 64;
