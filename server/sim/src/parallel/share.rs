//! The part of a body that a rank computes: a range of its blocks. Numbers, fields and rows are those of the whole body on
//! every rank; what neighbours compute is written where it belongs by an exchange, and sums keep the tree of the whole.

use std::{ops::Range, sync::Arc};

use super::{
    block_count,
    communicator::{Message, Ranks},
    each::Own,
    sum_by,
};
use crate::math::{Bytes, Padded, Real, bytes};

/// The part of a body that a rank computes.
#[derive(Clone, Debug)]
pub struct Share {
    block_size: usize,
    /// Blocks of the whole body.
    blocks: usize,
    own: Range<usize>,
    /// The others; none where this one computes all.
    party: Option<Arc<Party>>,
}

/// The ranks that compute a body together.
#[derive(Debug)]
struct Party {
    ranks: Ranks,
    /// The end of the blocks of each rank.
    ends: Vec<usize>,
    /// How many subtrees each rank adds by itself.
    subtrees: Vec<usize>,
    neighbours: Vec<Neighbour>,
}

/// A rank with particles that are joined to own ones.
#[derive(Debug)]
struct Neighbour {
    rank: usize,
    /// Own particles that are joined to its, ascending.
    sent: Vec<u32>,
    /// Its particles that are joined to own ones, ascending.
    received: Vec<u32>,
}

impl Share {
    /// All blocks of a body.
    pub fn whole(count: usize, block_size: usize) -> Self {
        let blocks = block_count(count, block_size);
        Self { block_size, blocks, own: 0..blocks, party: None }
    }

    /// What one of several ranks computes of a body whose particles are joined by pairs: each pair both ways or one, some
    /// more than once.
    pub(crate) fn of(
        count: usize,
        block_size: usize,
        pairs: impl Iterator<Item = [u32; 2]>,
        ranks: &Ranks,
    ) -> Self {
        let whole = Self::whole(count, block_size);
        let (rank, size) = (ranks.communicator.rank(), ranks.communicator.size());
        if size == 1 {
            return whole;
        }
        let ends: Vec<usize> = (1..=size).map(|rank| whole.blocks * rank / size).collect();
        let range = |rank: usize| whole.blocks * rank / size..ends[rank];
        let subtrees = (0..size).map(|rank| {
            let mut subtrees = 0;
            subtrees_of(0..whole.blocks, &range(rank), &mut |_| subtrees += 1);
            subtrees
        });
        let (subtrees, own) = (subtrees.collect(), range(rank));
        let owner = |particle: u32| ends.partition_point(|end| *end <= particle as usize / block_size);
        let neighbours = neighbours(pairs, owner, rank, size);
        let party = Party { ranks: ranks.clone(), ends, subtrees, neighbours };
        Self { own, party: Some(Arc::new(party)), ..whole }
    }

    /// Particles per block.
    pub(crate) fn block_size(&self) -> usize {
        self.block_size
    }

    /// The blocks that it computes.
    pub(crate) fn own(&self) -> Own {
        Own::of(self.own.clone(), self.block_size)
    }

    /// Whether a particle is one of its own.
    pub(crate) fn has(&self, particle: usize) -> bool {
        self.own.contains(&(particle / self.block_size))
    }

    /// Adds `of` of each block of the body in the tree of [`sum_by`]; `partials` is that of all blocks, own ones filled in.
    pub(crate) fn sum<T, const K: usize>(&self, partials: &[T], of: &impl Fn(&T) -> [f64; K]) -> [f64; K] {
        self.gather(partials, of, [], |[]| {})
    }

    /// Hands over what each rank tells, in their order.
    pub(crate) fn tell<const M: usize>(&self, told: [f64; M], each: impl FnMut([f64; M])) {
        self.gather::<(), 0, M>(&[], &|()| [], told, each);
    }

    /// Of what all ranks tell, that with the greatest first number; of equal ones that with the least second.
    pub(crate) fn greatest<const M: usize>(&self, told: [f64; M]) -> [f64; M] {
        let mut best: Option<[f64; M]> = None;
        self.tell(told, |told| {
            let is_better =
                best.is_none_or(|best| told[0] > best[0] || told[0] == best[0] && told[1] < best[1]);
            best = if is_better { Some(told) } else { best };
        });
        best.unwrap_or(told)
    }

    /// Both in one call.
    pub(crate) fn gather<T, const K: usize, const M: usize>(
        &self,
        partials: &[T],
        of: &impl Fn(&T) -> [f64; K],
        told: [f64; M],
        mut each: impl FnMut([f64; M]),
    ) -> [f64; K] {
        let Some(party) = &self.party else {
            each(told);
            return sum_by(partials, of);
        };
        let mut own = Vec::new();
        if K > 0 {
            subtrees_of(0..self.blocks, &self.own, &mut |range| own.extend(sum_by(&partials[range], of)));
        }
        own.extend(told);
        own.push(f64::from(u8::from(party.ranks.wanted.is_requested())));
        let lengths: Vec<usize> = party.subtrees.iter().map(|subtrees| subtrees * K + M + 1).collect();
        let mut all = Vec::new();
        party.ranks.communicator.gather(&own, &lengths, &mut all);

        let mut starts = Vec::with_capacity(lengths.len());
        let mut next = 0;
        for length in &lengths {
            starts.push(next);
            next += length;
            let [told @ .., wants] = &all[next - M - 1..next] else { continue };
            each(std::array::from_fn(|i| told[i]));
            if *wants > 0.0 {
                party.ranks.agreed.request();
            }
        }
        if K == 0 { [0.0; K] } else { party.rest(0..self.blocks, &all, &mut starts) }
    }

    /// Writes what neighbours computed of some fields where own rows read it.
    pub(crate) fn exchange<R: Real, const N: usize>(&self, mut fields: [&mut [Padded<R>]; N]) {
        let Some(party) = &self.party else { return };
        let message = |neighbour: &Neighbour| {
            let mut sent = Vec::with_capacity(N * neighbour.sent.len() * Padded::<R>::BYTES);
            for field in &fields {
                bytes::append(neighbour.sent.iter().map(|particle| &field[*particle as usize]), &mut sent);
            }
            let received = vec![0; N * neighbour.received.len() * Padded::<R>::BYTES];
            Message { rank: neighbour.rank, sent, received }
        };
        let mut messages: Vec<Message> = party.neighbours.iter().map(message).collect();
        party.ranks.communicator.exchange(&mut messages);
        for (neighbour, message) in party.neighbours.iter().zip(&messages) {
            let mut vectors = message.received.chunks_exact(Padded::<R>::BYTES);
            for field in &mut fields {
                for (particle, bytes) in neighbour.received.iter().zip(&mut vectors) {
                    field[*particle as usize] = Padded::read(bytes);
                }
            }
        }
    }

    /// Completes a field on rank 0.
    pub(crate) fn collect<R: Real>(&self, field: &mut [Padded<R>]) {
        if self.party.is_some() {
            let all = self.all_bytes(field);
            for (row, bytes) in field.iter_mut().zip(all.chunks_exact(Padded::<R>::BYTES)) {
                *row = Padded::read(bytes);
            }
        }
    }

    /// The bytes of a whole field, on rank 0.
    pub(crate) fn all_bytes<R: Real>(&self, field: &[Padded<R>]) -> Vec<u8> {
        let mut own = Vec::new();
        bytes::append(self.own().rows(field).iter(), &mut own);
        let Some(party) = &self.party else { return own };
        let rows = |block: usize| (block * self.block_size).min(field.len());
        let starts = std::iter::once(0).chain(party.ends.iter().copied());
        let lengths =
            starts.zip(&party.ends).map(|(start, end)| (rows(*end) - rows(start)) * Padded::<R>::BYTES);
        party.ranks.communicator.collect(&own, &lengths.collect::<Vec<_>>())
    }
}

impl Party {
    /// Adds what ranks added, in the order of the tree; `starts` is where the next sum of each rank stands in `all`.
    fn rest<const K: usize>(&self, range: Range<usize>, all: &[f64], starts: &mut [usize]) -> [f64; K] {
        if range.is_empty() {
            return [0.0; K];
        }
        let rank = self.ends.partition_point(|end| *end <= range.start);
        if range.end <= self.ends[rank] {
            let first = starts[rank];
            starts[rank] += K;
            return std::array::from_fn(|k| all[first + k]);
        }
        let half = range.start + range.len().next_power_of_two() / 2;
        let left: [f64; K] = self.rest(range.start..half, all, starts);
        let right: [f64; K] = self.rest(half..range.end, all, starts);
        std::array::from_fn(|k| left[k] + right[k])
    }
}

/// The largest subtrees below a range of blocks that lie within `own`, in their order.
fn subtrees_of(range: Range<usize>, own: &Range<usize>, each: &mut impl FnMut(Range<usize>)) {
    if range.is_empty() || range.end <= own.start || own.end <= range.start {
        return;
    }
    if own.start <= range.start && range.end <= own.end {
        return each(range);
    }
    let half = range.start + range.len().next_power_of_two() / 2;
    subtrees_of(range.start..half, own, each);
    subtrees_of(half..range.end, own, each);
}

/// The ranks that one shares pairs of particles with.
fn neighbours(
    pairs: impl Iterator<Item = [u32; 2]>,
    owner: impl Fn(u32) -> usize,
    rank: usize,
    size: usize,
) -> Vec<Neighbour> {
    let new = |rank| Neighbour { rank, sent: Vec::new(), received: Vec::new() };
    let mut all: Vec<Neighbour> = (0..size).map(new).collect();
    for pair in pairs {
        let owners = pair.map(&owner);
        if owners[0] == owners[1] {
            continue;
        }
        for (own, other) in [(0, 1), (1, 0)] {
            if owners[own] == rank {
                all[owners[other]].sent.push(pair[own]);
                all[owners[other]].received.push(pair[other]);
            }
        }
    }
    all.retain(|neighbour| !neighbour.sent.is_empty());
    for list in all.iter_mut().flat_map(|neighbour| [&mut neighbour.sent, &mut neighbour.received]) {
        list.sort_unstable();
        list.dedup();
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subtrees_and_the_rest_make_the_tree() {
        for blocks in [1, 2, 3, 7, 16, 23, 40, 61] {
            let partials: Vec<f64> =
                (0..blocks).map(|i| (0.7 + f64::from(i)).sqrt() * 1e9_f64.powi(i % 3)).collect();
            let of = |partial: &f64| [*partial, 1.0 / partial];
            let expected = sum_by(&partials, &of);
            for size in 1..=9 {
                let blocks = partials.len();
                let ends: Vec<usize> = (1..=size).map(|rank| blocks * rank / size).collect();
                let (mut all, mut starts) = (Vec::new(), Vec::new());
                for rank in 0..size {
                    starts.push(all.len());
                    let own = blocks * rank / size..ends[rank];
                    subtrees_of(0..blocks, &own, &mut |range| all.extend(sum_by(&partials[range], &of)));
                }
                let ranks = Ranks::new(Arc::new(Nobody));
                let (subtrees, neighbours) = (Vec::new(), Vec::new());
                let party = Party { ranks, ends, subtrees, neighbours };
                let found: [f64; 2] = party.rest(0..blocks, &all, &mut starts);
                assert_eq!(
                    found.map(f64::to_bits),
                    expected.map(f64::to_bits),
                    "{blocks} blocks, {size} ranks"
                );
            }
        }
    }

    /// Who talks to nobody.
    #[derive(Debug)]
    struct Nobody;

    impl super::super::Communicator for Nobody {
        fn rank(&self) -> usize {
            0
        }
        fn size(&self) -> usize {
            1
        }
        fn gather(&self, _: &[f64], _: &[usize], _: &mut Vec<f64>) {}
        fn exchange(&self, _: &mut [Message]) {}
        fn collect(&self, _: &[u8], _: &[usize]) -> Vec<u8> {
            Vec::new()
        }
    }

    #[test]
    fn both_sides_of_a_border_know_what_goes_over_it() {
        // A ring of 12 particles in blocks of two, on three ranks.
        let pairs = || (0..12_u32).map(|i| [i, (i + 1) % 12]);
        let owner = |particle: u32| particle as usize / 4;
        let of = |rank| neighbours(pairs(), owner, rank, 3);
        for rank in 0..3 {
            for neighbour in of(rank) {
                let back = of(neighbour.rank);
                let back = back.iter().find(|other| other.rank == rank).expect("neighbours are mutual");
                assert_eq!((&neighbour.sent, &neighbour.received), (&back.received, &back.sent));
                assert_eq!(neighbour.sent.len(), 1);
            }
            assert_eq!(of(rank).len(), 2);
        }
    }
}
