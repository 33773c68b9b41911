//! What a block of rows reads besides its own particles: the halo, other particles that its springs or elements reach.
//!
//! A block copies its own particles and its halo side by side before it works, so that what it gathers lies in the
//! first cache and is named by 16 bits: 0 to `block_size` are its own, those after them its halo, in the order in which
//! the block's items (slots of springs, packs of elements) first name them. A halo that would be too long is cut in
//! parts, each for some of the items.

use std::ops::Range;

use crate::math::{LANES, Padded, Real, Record};

/// Particles of one part of a halo, at most.
const LONGEST: usize = 2048;

/// The halos of all blocks.
#[derive(Clone, Debug, Default)]
pub(crate) struct Halos {
    block_size: usize,
    /// Rows of a block, at most: fewer than its size where there are no more in all, and then there is no halo.
    rows: usize,
    /// First part of each block, and one more.
    blocks: Vec<u32>,
    parts: Vec<Part>,
    /// Particles of all parts, one after the other.
    particles: Vec<u32>,
    longest: usize,
}

/// A part of a block's halo.
#[derive(Clone, Copy)]
pub(crate) struct Halo<'a>(&'a [u32]);

/// Particles, and the items that need no others.
#[derive(Clone, Debug)]
struct Part {
    particles: Range<u32>,
    items: Range<u32>,
}

impl Halos {
    /// The parts of a block: particles, and items.
    pub(crate) fn parts(&self, block: usize) -> impl Iterator<Item = (Halo<'_>, Range<usize>)> {
        self.parts_of(block).expect("there is such a block")
    }

    /// The same, if there is such a block.
    pub(crate) fn parts_of(&self, block: usize) -> Option<impl Iterator<Item = (Halo<'_>, Range<usize>)>> {
        let parts = *self.blocks.get(block)? as usize..*self.blocks.get(block + 1)? as usize;
        Some(self.parts[parts].iter().map(|Part { particles, items }| {
            let particles = particles.start as usize..particles.end as usize;
            (Halo(&self.particles[particles]), items.start as usize..items.end as usize)
        }))
    }

    /// Particles that a block and any part of its halo hold together, at most.
    pub(crate) fn room(&self) -> usize {
        self.rows + self.longest
    }

    /// The particle that an item of a block names.
    pub(crate) fn particle(&self, block: usize, item: usize, local: u16) -> u32 {
        let local = usize::from(local);
        if local < self.block_size {
            return (block * self.block_size + local) as u32;
        }
        let mut parts = self.parts(block);
        let (halo, _) = parts.find(|(_, items)| items.contains(&item)).expect("every item is in a part");
        halo.particles()[local - self.block_size]
    }
}

impl<'a> Halo<'a> {
    /// The particles by number, in the order in which they are named.
    pub(crate) fn particles(self) -> &'a [u32] {
        self.0
    }

    /// Copies its particles behind those of the block.
    #[inline(always)]
    pub(crate) fn copy<R: Real>(self, records: &mut [Record<R>], [x, y]: [&[Padded<R>]; 2]) {
        for (record, &particle) in records.iter_mut().zip(self.0) {
            record.0[0] = x[particle as usize];
            record.0[1] = y[particle as usize];
        }
    }
}

/// Halos while they are put together, item by item.
pub(crate) struct HaloBuilder {
    halos: Halos,
    /// Part that last named each particle (one more than its index), and its place in that part.
    seen: Vec<(u32, u16)>,
    items: u32,
}

impl HaloBuilder {
    /// For so many particles in blocks of a size.
    pub(crate) fn new(count: usize, block_size: usize) -> Self {
        let rows = block_size.min(count.next_multiple_of(LANES));
        let halos = Halos { block_size, rows, blocks: vec![0], ..Halos::default() };
        Self { halos, seen: vec![(0, 0); count], items: 0 }
    }

    /// Begins the next block.
    pub(crate) fn begin_block(&mut self) {
        self.begin_part();
    }

    fn begin_part(&mut self) {
        let first = self.halos.particles.len() as u32;
        self.halos.parts.push(Part { particles: first..first, items: self.items..self.items });
    }

    /// Ends the block.
    pub(crate) fn end_block(&mut self) {
        self.halos.blocks.push(self.halos.parts.len() as u32);
    }

    /// Adds the next item of the block, which needs these particles; writes how it names them.
    pub(crate) fn item(&mut self, particles: &[u32], names: &mut [u16]) {
        let part = self.halos.parts.last().expect("a block has begun");
        if part.particles.len() + particles.len() > LONGEST {
            self.begin_part();
        }

        self.items += 1;
        let block = self.halos.blocks.len() - 1;
        let own = block * self.halos.block_size..(block + 1) * self.halos.block_size;
        let number = self.halos.parts.len() as u32;
        let part = self.halos.parts.last_mut().expect("a block has begun");
        part.items.end = self.items;
        for (&particle, name) in particles.iter().zip(names) {
            let place = particle as usize;
            if own.contains(&place) {
                *name = (place - own.start) as u16;
                continue;
            }
            if self.seen[place].0 != number {
                self.seen[place] = (number, (own.len() + part.particles.len()) as u16);
                self.halos.particles.push(particle);
                part.particles.end += 1;
            }
            *name = self.seen[place].1;
        }
        self.halos.longest = self.halos.longest.max(part.particles.len());
    }

    /// The halos of all blocks that were ended.
    pub(crate) fn finish(self) -> Halos {
        self.halos
    }
}

/// Copies the particles of a block beside one another, each with both of its vectors.
#[inline(always)]
pub(crate) fn copy_own<R: Real>(records: &mut [Record<R>], rows: Range<usize>, [x, y]: [&[Padded<R>]; 2]) {
    for (record, (x, y)) in records.iter_mut().zip(x[rows.clone()].iter().zip(&y[rows])) {
        // Vector by vector: a record that is put together first goes through memory twice.
        record.0[0] = *x;
        record.0[1] = *y;
    }
}

/// The records behind those of a block of that size, for its halo: none where the block is all there is.
#[inline(always)]
pub(crate) fn behind<R: Real>(records: &mut [Record<R>], block_size: usize) -> &mut [Record<R>] {
    let own = block_size.min(records.len());
    &mut records[own..]
}
