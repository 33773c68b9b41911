//! Snow over ranks: which blocks each owns, and what goes from one to another.
//!
//! A rank owns the places whose keys lie between two cuts, with or without particles. So its blocks follow one another in the
//! list of one process, and sums keep the tree over that list. It computes the particles in its blocks; all others lie in its
//! arrays as they were when they left it.

use std::{cmp::Ordering, ops::Range};

use super::{
    bound::{Culprits, Extremes},
    grid::{AROUND, Grid, block_of, direction, key_of, shifted},
    transfer::GridDiagnostics,
};
use crate::{
    math::Real,
    parallel::{Post, Ranks, Share, hash_numbers},
    report::Notices,
};

/// Particles that an empty block counts for where work is divided.
const BLOCK_WEIGHT: u64 = 16;

/// What a rank knows of the others.
#[derive(Clone, Debug)]
pub(super) struct SnowRanks {
    pub(super) ranks: Ranks,
    /// The first key of each rank, and an end; none before the first step, when all is everybody's.
    cuts: Vec<u64>,
    /// The place of each particle, by the user's number.
    pub(super) place_of: Vec<u32>,
    /// Own blocks of particles that others need, and blocks of others that are needed: of each rank, in ascending order.
    sent: Vec<Vec<u32>>,
    received: Vec<Vec<u32>>,
    /// Blocks of particles, and of nodes, of all ranks.
    pub(super) blocks: Share,
    pub(super) nodes: Share,
    /// How many of each there are on each rank, while that is told.
    counts: [Vec<usize>; 2],
    /// Keys of blocks of others that are needed, while they are being found.
    others: Vec<u64>,
    /// What goes to others and comes from them.
    pub(super) post: Post,
    /// Places in the order that particles are put in, and which of them are own ones.
    pub(super) order: Vec<u32>,
    pub(super) is_own: Vec<bool>,
}

impl SnowRanks {
    pub(super) fn new(ranks: Ranks) -> Self {
        let (size, _) = ranks.size_and_rank();
        let [blocks, nodes] = [(); 2].map(|()| Share::counted(&ranks, &vec![0; size]));
        Self {
            ranks,
            cuts: Vec::new(),
            place_of: Vec::new(),
            sent: vec![Vec::new(); size],
            received: vec![Vec::new(); size],
            blocks,
            nodes,
            counts: [Vec::new(), Vec::new()],
            others: Vec::new(),
            post: Post::default(),
            order: Vec::new(),
            is_own: Vec::new(),
        }
    }

    /// Whether each rank has its part.
    pub(super) fn is_divided(&self) -> bool {
        !self.cuts.is_empty()
    }

    /// Cuts the list of all blocks, of which `starts` says where particles begin, into parts of about equal weight, or into
    /// such as are drawn.
    pub(super) fn cut(&mut self, blocks: &[u64], starts: &[u32]) {
        let (size, _) = self.ranks.size_and_rank();
        let weight = |block: usize| u64::from(starts[block]) + BLOCK_WEIGHT * block as u64;
        let total = weight(blocks.len());
        let first = |rank: usize| {
            let least = total * rank as u64 / size as u64;
            let block = (0..blocks.len()).find(|block| weight(*block) >= least);
            block.map_or(u64::MAX - 1, |block| blocks[block])
        };
        let mut cuts: Vec<u64> = match self.ranks.communicator.parts_drawn_from() {
            None => (1..size).map(first).collect(),
            Some(seed) => (1..size).map(|rank| drawn(blocks, seed, rank)).collect(),
        };
        cuts.sort_unstable();
        self.cuts = std::iter::once(0).chain(cuts).chain([u64::MAX]).collect();
    }

    /// Takes over where each particle is: `id` has the user's number of each place.
    pub(super) fn find_places(&mut self, id: &[u32]) {
        self.place_of.resize(id.len(), 0);
        (0..).zip(id).for_each(|(place, id)| self.place_of[*id as usize] = place);
    }

    /// The rank that owns a key.
    pub(super) fn owner(&self, key: u64) -> usize {
        self.cuts[1..].partition_point(|cut| *cut <= key)
    }

    /// The keys between its own two cuts.
    pub(super) fn own_keys(&self) -> Range<u64> {
        let (_, rank) = self.ranks.size_and_rank();
        self.cuts[rank]..self.cuts[rank + 1]
    }

    /// Finds out which blocks others need, tells them their keys, and puts those that are needed here beside own ones. Whether
    /// any of these has changed.
    pub(super) fn meet<R: Real>(&mut self, grid: &mut Grid<R>, periodic: [u32; 3]) -> bool {
        let (_, rank) = self.ranks.size_and_rank();
        let mut sent = std::mem::take(&mut self.sent);
        sent.iter_mut().for_each(Vec::clear);
        for (block, key) in (0..).zip(&grid.blocks) {
            for i in 0..AROUND {
                let owner = self.owner(key_of(shifted(block_of(*key), direction(i), periodic)));
                if owner != rank && sent[owner].last() != Some(&block) {
                    sent[owner].push(block);
                }
            }
        }
        self.sent = sent;

        let Self { ranks, sent, received, others, post, .. } = self;
        post.clear(sent.len());
        for (other, blocks) in sent.iter().enumerate() {
            let keys = blocks.iter().flat_map(|block| grid.blocks[*block as usize].to_le_bytes());
            post.sent_to(other).extend(keys);
        }
        post.swap(ranks);

        others.clear();
        others.extend(post.received().flat_map(keys_in));
        others.sort_unstable();
        let place = |key: u64| others.binary_search(&key).expect("it was put there") as u32;
        for (places, bytes) in received.iter_mut().zip(post.received()) {
            places.clear();
            places.extend(keys_in(bytes).map(place));
        }
        let has_changed = *others != grid.others;
        std::mem::swap(others, &mut grid.others);
        has_changed
    }

    /// Fetches the tiles of others, of `len` numbers each.
    pub(super) fn fetch_tiles<R: Real>(&mut self, own: usize, tiles: &mut [R], len: usize) {
        let bytes = len * R::BYTES;
        let Self { ranks, sent, received, post, .. } = self;
        post.clear(sent.len());
        for (other, (sent, received)) in sent.iter().zip(&*received).enumerate() {
            let to = post.sent_to(other);
            to.resize(sent.len() * bytes, 0);
            let blocks = sent.iter().map(|block| *block as usize);
            let numbers = blocks.flat_map(|block| &tiles[block * len..(block + 1) * len]);
            numbers.zip(to.chunks_exact_mut(R::BYTES)).for_each(|(number, bytes)| number.write(bytes));
            post.expect_from(other, received.len() * bytes);
        }
        post.exchange(ranks);
        for (received, all) in received.iter().zip(post.received()) {
            for (block, bytes) in received.iter().zip(all.chunks_exact(bytes)) {
                let start = (own + *block as usize) * len;
                let numbers = bytes.chunks_exact(R::BYTES);
                tiles[start..start + len]
                    .iter_mut()
                    .zip(numbers)
                    .for_each(|(out, bytes)| *out = R::read(bytes));
            }
        }
    }

    /// Tells what a step found, hands over what each rank tells, in their order, and takes over how many blocks each has now.
    /// Returns what was given in all (J), of which `given` is that of own blocks before.
    pub(super) fn count(&mut self, told: &Found, given: &[f64], mut each: impl FnMut(&Found)) -> f64 {
        let Self { blocks, nodes, counts: [of_blocks, of_nodes], .. } = self;
        of_blocks.clear();
        of_nodes.clear();
        let [given] = blocks.sum_own_and_tell(given, &|given| [*given], told.numbers(), |numbers| {
            let found = Found::of(&numbers);
            of_blocks.push(found.blocks);
            of_nodes.push(found.nodes);
            each(&found);
        });
        blocks.recount(of_blocks);
        nodes.recount(of_nodes);
        given
    }

    /// What all nodes add up to, from what own ones do, block by block.
    pub(super) fn total(&self, own: GridDiagnostics, blocks: &[GridDiagnostics]) -> GridDiagnostics {
        let mut total = GridDiagnostics::default();
        let [x, y, z] = own.fastest.map(f64::from);
        let told = [own.contacts as f64, own.speed2, x, y, z];
        let each = |[contacts, speed2, x, y, z]: [f64; 5]| {
            total.contacts += contacts as u64;
            if (speed2 > total.speed2 || speed2.is_nan()) && !total.speed2.is_nan() {
                (total.speed2, total.fastest) = (speed2, [x, y, z].map(|c| c as i32));
            }
        };
        let sums = self.nodes.sum_own_and_tell(blocks, &GridDiagnostics::sums, told, each);
        [total.mass, total.dropped, total.medium_work, total.wind_work] = sums;
        total
    }
}

/// The keys that were sent as bytes.
fn keys_in(bytes: &[u8]) -> impl Iterator<Item = u64> {
    bytes.as_chunks().0.iter().map(|key| u64::from_le_bytes(*key))
}

/// A key to cut at: that of a block, or the one behind it. From an odd seed two ranks at a time have the same.
fn drawn(blocks: &[u64], seed: u64, rank: usize) -> u64 {
    let rank = if seed.is_multiple_of(2) { rank } else { rank / 2 * 2 };
    let number = hash_numbers(seed, [rank as f64]);
    blocks[(number >> 1) as usize % blocks.len()] + number % 2
}

/// What a rank found in a step, for all to know.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
    /// Its blocks of particles and of nodes, from now on.
    pub(super) blocks: usize,
    pub(super) nodes: usize,
    pub(super) extremes: Extremes,
    /// The particles of these, where they were looked for.
    pub(super) culprits: Culprits,
    /// Whether no particle went too far to be followed.
    pub(super) followed: bool,
    pub(super) notices: Notices,
}

impl Found {
    fn numbers(&self) -> [f64; 15] {
        let Self { blocks, nodes, extremes, culprits, followed, notices } = self;
        let id = |id: Option<u64>| id.map_or(f64::INFINITY, |id| id as f64);
        let mut numbers = [0.0; 15];
        numbers[..2].copy_from_slice(&[*blocks as f64, *nodes as f64]);
        numbers[2..7].copy_from_slice(&extremes.values());
        numbers[7..12].copy_from_slice(&culprits.0.map(id));
        let passed = [notices.passed_count as f64, id(notices.first_passed)];
        numbers[12..].copy_from_slice(&[f64::from(u8::from(*followed)), passed[0], passed[1]]);
        numbers
    }

    fn of(numbers: &[f64; 15]) -> Self {
        let id = |number: f64| number.is_finite().then_some(number as u64);
        let five = |first: usize| std::array::from_fn(|k| numbers[first + k]);
        Self {
            blocks: numbers[0] as usize,
            nodes: numbers[1] as usize,
            extremes: Extremes::of(five(2)),
            culprits: Culprits(five(7).map(id)),
            followed: numbers[12] > 0.0,
            notices: Notices {
                passed_count: numbers[13] as u64,
                first_passed: id(numbers[14]),
                ..Notices::default()
            },
        }
    }

    /// Of both: the greater extremes with their particles, of equal ones the particle of the least number.
    pub(super) fn and(&self, other: &Self) -> Self {
        let (own, others) = (self.extremes.values(), other.extremes.values());
        let [ids, other_ids] = [self.culprits.0, other.culprits.0];
        let culprits = std::array::from_fn(|k| match own[k].total_cmp(&others[k]) {
            Ordering::Greater => ids[k],
            Ordering::Less => other_ids[k],
            Ordering::Equal => ids[k].into_iter().chain(other_ids[k]).min(),
        });
        Self {
            extremes: self.extremes.max(other.extremes),
            culprits: Culprits(culprits),
            followed: self.followed && other.followed,
            notices: self.notices.and(other.notices),
            ..*self
        }
    }
}
