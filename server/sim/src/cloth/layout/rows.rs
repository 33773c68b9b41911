//! Springs as a sparse matrix in sliced ELLPACK: row i holds the springs of particle i. Slices have sixteen rows, which
//! are sorted by length within a block (SELL-16-σ; Kreutzer et al. 2014).
//!
//! Every particle adds its own springs, in a fixed order, so that rows run in parallel, nothing is scattered, and no
//! result depends on who computes it. Spring s of each of the sixteen rows of a group makes a slot, evaluated in one
//! pack of lanes. Both ends of a spring compute it: the two forces are exact opposites.
#![allow(unsafe_code, reason = "lanes read neighbours whose range was checked when the rows were built")]

use std::{collections::BTreeMap, ops::Range};

use super::{
    ahead::Ahead,
    halo::{HaloBuilder, Halos, behind, copy_own},
};
use crate::{
    interrupt,
    math::{LANES, Lanes, Pack, Padded, Real, Record, three},
};

/// A spring in the model's numbering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Joint {
    pub(crate) ends: [u32; 2],
    pub(crate) rest_length: f64,
    pub(crate) law: u16,
}

/// Springs by row, in sliced ELLPACK.
#[derive(Clone, Debug)]
pub struct Springs<R> {
    /// First slot of each group of rows, and one more.
    starts: Vec<u32>,
    /// Other end of the spring in each lane, as its block names it; a lane without one names its own row.
    neighbours: Vec<[u16; LANES]>,
    /// Rest length (m) in each lane.
    pub(crate) rest_lengths: Vec<[R; LANES]>,
    /// Which of `patterns` the laws of a slot's lanes are.
    pub(crate) pattern_of: Vec<u32>,
    /// Laws of sixteen lanes, each once.
    pub(crate) patterns: Vec<[u16; LANES]>,
    halos: Halos,
    block_size: usize,
}

/// What is added up over the springs of sixteen rows, all at a time or part by part.
pub(crate) trait Fold<P: Lanes> {
    /// The sums of as many rows.
    type Sums: Copy;
    /// The sums so far of a part of the rows of a group, counted within the block. Mark it and the others
    /// `#[inline(always)]`.
    fn sums(&self, at: [usize; 2]) -> Self::Sums;
    /// Adds the springs of a part of a slot: `d` is the own position less the other's (m), `w` the same of the second
    /// field. A lane without a spring has d = w = 0 and rest length 0.
    fn add(&mut self, sums: &mut Self::Sums, at: [usize; 2], d: [P; 3], w: [P; 3]);
    /// Takes the sums back.
    fn keep(&mut self, at: [usize; 2], sums: Self::Sums);
}

/// What looks at the springs of a block and at vectors of the particles that they join. It is a trait, since a closure in
/// its place would not be compiled for the vector instructions of its caller.
pub(crate) trait Visit<P: Pack> {
    /// Two vectors of a particle. Mark it and the others `#[inline(always)]`.
    fn vectors(&self, particle: usize) -> [Padded<P::Number>; 2];
    /// Begins with a part of the halo: particles for which names from the block size on stand.
    fn begin(&mut self, halo: &[u32]);
    /// A slot of sixteen rows, of which the first is given: vectors of the rows, those of the others, and the others' names.
    /// A lane without a spring names its own row.
    fn slot(&mut self, at: (usize, usize), own: [[P; 3]; 2], others: [[P; 3]; 2], names: &[u16; LANES]);
}

/// One end of a spring while rows are gathered: the particle at the other, the rest length, the law.
type End<R> = (u32, R, u16);

/// A spring as its row sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowSpring<R> {
    /// The particle at the other end.
    pub(crate) other: u32,
    /// Rest length (m).
    pub(crate) rest_length: R,
    /// Slot and lane.
    pub(crate) place: (usize, usize),
}

impl<R: Real> Springs<R> {
    /// Gathers springs by row. A block's rows are in groups of their own.
    pub(crate) fn new(count: usize, block_size: usize, joints: &[Joint]) -> Self {
        assert!(block_size.is_multiple_of(LANES), "groups of rows lie within a block");
        let mut rows: Vec<Vec<End<R>>> = vec![Vec::new(); count];
        for &Joint { ends: [a, b], rest_length, law } in joints {
            interrupt::point();
            rows[a as usize].push((b, R::of(rest_length), law));
            rows[b as usize].push((a, R::of(rest_length), law));
        }

        for row in &mut rows {
            interrupt::point();
            row.sort_by(|a, b| (a.2, a.0).cmp(&(b.2, b.0)).then(a.1.to_f64().total_cmp(&b.1.to_f64())));
        }

        let mut builder = Builder::new(count, block_size);
        for rows in rows.chunks(block_size) {
            builder.push_block(rows);
        }
        builder.finish(block_size)
    }

    /// Springs of one row in the order in which they are added.
    pub(crate) fn row(&self, row: usize) -> impl Iterator<Item = RowSpring<R>> {
        let (group, lane, block) = (row / LANES, row % LANES, row / self.block_size);
        let own = (row % self.block_size) as u16;
        (self.starts[group] as usize..self.starts[group + 1] as usize)
            .filter(move |&slot| self.neighbours[slot][lane] != own)
            .map(move |slot| {
                let other = self.halos.particle(block, slot, self.neighbours[slot][lane]);
                RowSpring { other, rest_length: self.rest_lengths[slot][lane], place: (slot, lane) }
            })
    }

    /// Number of slots.
    pub(crate) fn slot_count(&self) -> usize {
        self.neighbours.len()
    }

    /// Slots of a block.
    pub(crate) fn slots(&self, block: usize) -> Range<usize> {
        let groups = self.block_size / LANES;
        let last = self.starts.len() - 1;
        let [from, to] = [block, block + 1].map(|block| self.starts[(block * groups).min(last)] as usize);
        from..to
    }

    /// Records that a block copies, at most.
    pub(crate) fn room(&self) -> usize {
        self.halos.room()
    }

    /// Folds the springs of a block, whose particles and halo are copied into `records`; `fields` are over all
    /// particles.
    ///
    /// # Panics
    /// If there is not as much room as [`Self::room`] says.
    #[inline(always)]
    pub(crate) fn fold_block<P: Lanes<Number = R>>(
        &self,
        block: usize,
        fields: [&[Padded<R>]; 2],
        records: &mut [Record<R>],
        fold: &mut impl Fold<P>,
    ) {
        let first_row = block * self.block_size;
        let rows = first_row..(first_row + self.block_size).min(fields[0].len());
        assert!(records.len() >= self.room(), "room for a block and its halo");
        copy_own(records, rows.clone(), fields);

        let first_group = first_row / LANES;
        let mut next = Ahead::of(&self.halos, block, self.block_size);
        for (halo, slots) in self.halos.parts(block) {
            halo.copy(behind(records, self.block_size), fields);
            for group in 0..rows.len() / LANES {
                next.ask(fields);
                let start = (self.starts[first_group + group] as usize).max(slots.start);
                let end = (self.starts[first_group + group + 1] as usize).min(slots.end);
                if start < end {
                    for part in 0..P::PARTS {
                        let at = [group, part];
                        let mut sums = fold.sums(at);
                        self.fold_group(at, start..end, records, &mut sums, fold);
                        fold.keep(at, sums);
                    }
                }
            }
        }
    }

    /// Copies the particles of a block and the first part of its halo into `records`.
    ///
    /// # Panics
    /// If there is not as much room as [`Self::room`] says.
    #[inline(always)]
    pub(crate) fn copy_block(&self, block: usize, fields: [&[Padded<R>]; 2], records: &mut [Record<R>]) {
        let first = block * self.block_size;
        copy_own(records, first..(first + self.block_size).min(fields[0].len()), fields);
        self.copy_first_halo(block, fields, records);
    }

    /// Copies the first part of a block's halo into `records`, behind the block's particles.
    ///
    /// # Panics
    /// If there is not as much room as [`Self::room`] says.
    #[inline(always)]
    pub(crate) fn copy_first_halo(&self, block: usize, fields: [&[Padded<R>]; 2], records: &mut [Record<R>]) {
        assert!(records.len() >= self.room(), "room for a block and its halo");
        if let Some((halo, _)) = self.halos.parts(block).next() {
            halo.copy(behind(records, self.block_size), fields);
        }
    }

    /// Folds the springs of one group of a block's rows. The block's particles are in `records`, behind them the first part
    /// of its halo; where there are more, each is copied there before it is read.
    ///
    /// # Panics
    /// If there is not as much room as [`Self::room`] says.
    #[inline(always)]
    pub(crate) fn fold_rows<P: Pack<Number = R>>(
        &self,
        [block, group]: [usize; 2],
        fields: [&[Padded<R>]; 2],
        records: &mut [Record<R>],
        fold: &mut impl Fold<P>,
    ) {
        assert!(records.len() >= self.room(), "room for a block and its halo");
        let at = block * self.block_size / LANES + group;
        let is_whole = self.halos.parts(block).nth(1).is_none();
        let mut sums = fold.sums([group, 0]);
        for (halo, slots) in self.halos.parts(block) {
            let start = (self.starts[at] as usize).max(slots.start);
            let end = (self.starts[at + 1] as usize).min(slots.end);
            if start < end {
                if !is_whole {
                    halo.copy(behind(records, self.block_size), fields);
                }
                self.fold_group([group, 0], start..end, records, &mut sums, fold);
            }
        }
        fold.keep([group, 0], sums);
    }

    /// Shows the springs of a block in the order of slots; the block's particles and its halo are copied into `records`.
    ///
    /// # Panics
    /// If there is not as much room as [`Self::room`] says.
    #[inline(always)]
    pub(crate) fn visit_block<P: Pack<Number = R>>(
        &self,
        block: usize,
        rows: Range<usize>,
        records: &mut [Record<R>],
        visit: &mut impl Visit<P>,
    ) {
        assert!(records.len() >= self.room(), "room for a block and its halo");
        for (record, particle) in records.iter_mut().zip(rows) {
            record.0 = visit.vectors(particle);
        }
        for (halo, slots) in self.halos.parts(block) {
            for (record, &particle) in behind(records, self.block_size).iter_mut().zip(halo.particles()) {
                record.0 = visit.vectors(particle as usize);
            }
            visit.begin(halo.particles());
            let first_group = block * self.block_size / LANES;
            let mut group = first_group;
            for slot in slots {
                while self.starts[group + 1] as usize <= slot {
                    group += 1;
                }
                let own = std::array::from_fn(|lane| ((group - first_group) * LANES + lane) as u16);
                // SAFETY: the rows of a group lie within its block, for whose particles there is room; and `new` names
                // particles of the block and of the part of its halo that the slot is in.
                let [own, others] =
                    unsafe { [P::gather(records, &own), P::gather(records, &self.neighbours[slot])] };
                visit.slot((slot, group * LANES), own, others, &self.neighbours[slot]);
            }
        }
    }

    /// Folds some slots of a part of a group's rows.
    #[inline(always)]
    fn fold_group<P: Lanes<Number = R>, F: Fold<P>>(
        &self,
        [group, part]: [usize; 2],
        slots: Range<usize>,
        records: &[Record<R>],
        sums: &mut F::Sums,
        fold: &mut F,
    ) {
        let own = std::array::from_fn(|lane| (group * LANES + lane) as u16);
        // SAFETY: the rows of a group lie within its block, for whose particles there is room.
        let [x, y] = unsafe { P::gather_part(records, &own, part) };
        for (slot, names) in slots.clone().zip(&self.neighbours[slots]) {
            // SAFETY: `new` names particles of the block and of the part of its halo that the slot is in: fewer than
            // `room`, which is no more than there are records.
            let [other_x, other_y] = unsafe { P::gather_part(records, names, part) };
            let d = three!(|c| x[c] - other_x[c]);
            let w = three!(|c| y[c] - other_y[c]);
            fold.add(sums, [slot, part], d, w);
        }
    }
}

/// The order of rows within blocks, so that rows of a group are of one length and of the same laws: `order[new] = old`,
/// from the laws of each row's springs.
pub(crate) fn sort_rows(count: usize, block_size: usize, joints: &[Joint]) -> Vec<u32> {
    let mut laws = vec![Vec::new(); count];
    for joint in joints {
        interrupt::point();
        joint.ends.iter().for_each(|end| laws[*end as usize].push(joint.law));
    }
    for laws in &mut laws {
        interrupt::point();
        laws.sort_unstable();
    }

    let mut order: Vec<u32> = (0..count as u32).collect();
    for block in order.chunks_mut(block_size) {
        interrupt::point();
        block.sort_by(|a, b| {
            let [a, b] = [a, b].map(|row| &laws[*row as usize]);
            b.len().cmp(&a.len()).then_with(|| a.cmp(b))
        });
    }
    order
}

/// Rows while they are gathered.
struct Builder<R> {
    starts: Vec<u32>,
    neighbours: Vec<[u16; LANES]>,
    rest_lengths: Vec<[R; LANES]>,
    pattern_of: Vec<u32>,
    patterns: BTreeMap<[u16; LANES], u32>,
    halos: HaloBuilder,
    /// How many rows were gathered so far.
    count: usize,
}

impl<R: Real> Builder<R> {
    fn new(count: usize, block_size: usize) -> Self {
        Self {
            starts: vec![0],
            neighbours: Vec::new(),
            rest_lengths: Vec::new(),
            pattern_of: Vec::new(),
            patterns: BTreeMap::new(),
            halos: HaloBuilder::new(count, block_size),
            count: 0,
        }
    }

    fn push_block(&mut self, rows: &[Vec<End<R>>]) {
        self.halos.begin_block();
        for rows in rows.chunks(LANES) {
            interrupt::point();
            let width = rows.iter().map(Vec::len).max().unwrap_or(0);
            (0..width).for_each(|slot| self.push_slot(rows, slot));
            self.starts.push(self.neighbours.len() as u32);
            self.count += rows.len();
        }
        self.halos.end_block();
    }

    fn push_slot(&mut self, rows: &[Vec<End<R>>], slot: usize) {
        // A lane without a spring names its row: d = 0, so that it adds nothing. Its law is that of another lane.
        let first = rows.iter().find_map(|row| row.get(slot)).expect("a slot holds a spring");
        let mut others: [u32; LANES] = std::array::from_fn(|lane| (self.count + lane) as u32);
        let (mut rest_lengths, mut laws) = ([R::zero(); LANES], [first.2; LANES]);
        for (lane, row) in rows.iter().enumerate() {
            if let Some(&(other, rest_length, law)) = row.get(slot) {
                (others[lane], rest_lengths[lane], laws[lane]) = (other, rest_length, law);
            }
        }

        let next = self.patterns.len() as u32;
        self.pattern_of.push(*self.patterns.entry(laws).or_insert(next));
        let mut names = [0; LANES];
        self.halos.item(&others, &mut names);
        self.neighbours.push(names);
        self.rest_lengths.push(rest_lengths);
    }

    fn finish(self, block_size: usize) -> Springs<R> {
        let mut patterns = vec![[0; LANES]; self.patterns.len()];
        self.patterns.into_iter().for_each(|(pattern, place)| patterns[place as usize] = pattern);
        Springs {
            starts: self.starts,
            neighbours: self.neighbours,
            rest_lengths: self.rest_lengths,
            pattern_of: self.pattern_of,
            patterns,
            halos: self.halos.finish(),
            block_size,
        }
    }
}
