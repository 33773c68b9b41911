//! The ranks that compute a body together: which blocks each has, and how sums over all blocks are made of theirs.

use std::ops::Range;

use super::{border::Border, communicator::Ranks, spare::Spare, sum_by};
use crate::math::Bytes;

/// The ranks that compute a body together.
#[derive(Debug)]
pub(super) struct Party {
    pub(super) ranks: Ranks,
    /// The end of the blocks of each rank.
    ends: Vec<usize>,
    /// How many subtrees each rank adds by itself.
    subtrees: Vec<usize>,
    /// What goes from particles to those of other ranks.
    pub(super) border: Border,
    lists: Spare<Lists>,
}

/// What an all-gather sends and receives.
#[derive(Debug, Default)]
pub(super) struct Lists {
    /// Of this rank.
    pub(super) own: Vec<u8>,
    /// Of all ranks, in their order.
    all: Vec<u8>,
    /// How many bytes each rank sends.
    lengths: Vec<usize>,
    /// Where what is not read yet of each rank begins.
    starts: Vec<usize>,
}

impl Lists {
    /// The next value of a rank.
    pub(super) fn next<T: Bytes>(&mut self, rank: usize) -> T {
        let start = self.starts[rank];
        self.starts[rank] += T::BYTES;
        T::read(&self.all[start..start + T::BYTES])
    }

    /// Adds to what this rank sends.
    pub(super) fn tell<T: Bytes>(&mut self, value: &T) {
        let start = self.own.len();
        self.own.resize(start + T::BYTES, 0);
        value.write(&mut self.own[start..]);
    }
}

/// Numbers as they are told.
pub(super) struct Numbers<const K: usize>(pub(super) [f64; K]);

impl<const K: usize> Bytes for Numbers<K> {
    const BYTES: usize = 8 * K;

    fn write(&self, bytes: &mut [u8]) {
        for (number, bytes) in self.0.iter().zip(bytes.as_chunks_mut().0) {
            *bytes = number.to_le_bytes();
        }
    }

    fn read(bytes: &[u8]) -> Self {
        let numbers = bytes.as_chunks().0;
        Self(std::array::from_fn(|k| f64::from_le_bytes(numbers[k])))
    }
}

/// The end of the blocks of each of `size` ranks.
pub(super) fn ends(blocks: usize, size: usize) -> Vec<usize> {
    (1..=size).map(|rank| blocks * rank / size).collect()
}

/// The end of the blocks of each rank, from how many each has.
pub(super) fn ends_of(counts: &[usize]) -> impl Iterator<Item = usize> {
    counts.iter().scan(0, |end, count| {
        *end += count;
        Some(*end)
    })
}

/// The rank that has a block.
pub(super) fn owner(ends: &[usize], block: usize) -> usize {
    ends.partition_point(|end| *end <= block)
}

impl Party {
    pub(super) fn new(ranks: Ranks, ends: Vec<usize>, border: Border) -> Self {
        let subtrees = subtrees_per_rank(&ends).collect();
        Self { ranks, ends, subtrees, border, lists: Spare::default() }
    }

    /// Takes over how many blocks each rank has from now on.
    pub(super) fn recount(&mut self, counts: &[usize]) {
        self.ends.clear();
        self.ends.extend(ends_of(counts));
        self.subtrees.clear();
        self.subtrees.extend(subtrees_per_rank(&self.ends));
    }

    /// How many there are.
    pub(super) fn size(&self) -> usize {
        self.ends.len()
    }

    /// The rank that has a block.
    pub(super) fn owner(&self, block: usize) -> usize {
        owner(&self.ends, block)
    }

    /// The blocks of a rank.
    pub(super) fn blocks(&self, rank: usize) -> Range<usize> {
        range(&self.ends, rank)
    }

    /// Blocks of the whole body.
    fn all_blocks(&self) -> Range<usize> {
        0..self.ends[self.size() - 1]
    }

    /// Begins an all-gather: lists to which is added what this rank tells, and which [`Self::put`] takes back. All know since
    /// then who wants to give up.
    pub(super) fn begin(&self) -> Lists {
        let mut lists = self.lists.take();
        lists.own.clear();
        lists.own.push(u8::from(self.ranks.wanted.is_requested()));
        lists
    }

    /// Tells what this rank adds of `of` of each block, those of `own` from `partials`, the first of which is that of block
    /// `first`: to begin with.
    pub(super) fn tell_sums<T, const K: usize>(
        &self,
        lists: &mut Lists,
        own: &Range<usize>,
        (partials, first): (&[T], usize),
        of: &impl Fn(&T) -> [f64; K],
    ) {
        let each = &mut |range: Range<usize>| {
            lists.tell(&Numbers(sum_by(&partials[range.start - first..range.end - first], of)));
        };
        if K > 0 {
            subtrees_of(self.all_blocks(), own, each);
        }
    }

    /// Gathers what all tell: `K` sums of each subtree, and then `length(rank)` bytes. Returns the sums of all, added in the
    /// tree of [`sum_by`].
    pub(super) fn all_gather<const K: usize>(
        &self,
        lists: &mut Lists,
        length: impl Fn(usize) -> usize,
    ) -> [f64; K] {
        let Lists { own, all, lengths, starts } = lists;
        let Ranks { communicator, agreed, .. } = &self.ranks;
        let of_sums = |rank: usize| self.subtrees[rank] * Numbers::<K>::BYTES;
        lengths.clear();
        lengths.extend((0..self.size()).map(|rank| 1 + of_sums(rank) + length(rank)));
        communicator.all_gather(own, lengths, all);

        starts.clear();
        let mut next = 0;
        for length in lengths {
            if all[next] > 0 {
                agreed.request();
            }
            starts.push(next + 1);
            next += *length;
        }
        if K > 0 { self.rest(self.all_blocks(), lists) } else { [0.0; K] }
    }

    /// Keeps lists for the next all-gather.
    pub(super) fn put(&self, lists: Lists) {
        self.lists.put(lists);
    }

    /// Adds what ranks added, in the order of the tree.
    fn rest<const K: usize>(&self, range: Range<usize>, lists: &mut Lists) -> [f64; K] {
        if range.is_empty() {
            return [0.0; K];
        }
        let rank = self.owner(range.start);
        if range.end <= self.ends[rank] {
            return lists.next::<Numbers<K>>(rank).0;
        }
        let half = range.start + range.len().next_power_of_two() / 2;
        let left: [f64; K] = self.rest(range.start..half, lists);
        let right: [f64; K] = self.rest(half..range.end, lists);
        std::array::from_fn(|k| left[k] + right[k])
    }
}

fn range(ends: &[usize], rank: usize) -> Range<usize> {
    let start = if rank == 0 { 0 } else { ends[rank - 1] };
    start..ends[rank]
}

/// How many subtrees each rank adds by itself.
fn subtrees_per_rank(ends: &[usize]) -> impl Iterator<Item = usize> {
    let blocks = ends.last().copied().unwrap_or(0);
    (0..ends.len()).map(move |rank| {
        let mut subtrees = 0;
        subtrees_of(0..blocks, &range(ends, rank), &mut |_| subtrees += 1);
        subtrees
    })
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::parallel::{Communicator, Message};

    #[test]
    fn subtrees_and_the_rest_make_the_tree() {
        for blocks in [1, 2, 3, 7, 16, 23, 40, 61] {
            let partials: Vec<f64> =
                (0..blocks).map(|i| (0.7 + f64::from(i)).sqrt() * 1e9_f64.powi(i % 3)).collect();
            let of = |partial: &f64| [*partial, 1.0 / partial];
            let expected = sum_by(&partials, &of);
            for size in 1..=9 {
                let blocks = partials.len();
                let border = Border::of(Vec::new());
                let party = Party::new(Ranks::new(Arc::new(Nobody)), ends(blocks, size), border);
                let mut lists = Lists::default();
                for rank in 0..size {
                    lists.starts.push(lists.own.len());
                    let tell = &mut |range| lists.tell(&Numbers(sum_by(&partials[range], &of)));
                    subtrees_of(0..blocks, &party.blocks(rank), tell);
                }
                lists.all = lists.own.clone();
                let found: [f64; 2] = party.rest(0..blocks, &mut lists);
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

    impl Communicator for Nobody {
        fn rank(&self) -> usize {
            0
        }
        fn size(&self) -> usize {
            1
        }
        fn all_gather(&self, _: &[u8], _: &[usize], _: &mut Vec<u8>) {}
        fn exchange(&self, _: &mut [Message]) {}
        fn gather(&self, _: &[u8], _: &[usize]) -> Vec<u8> {
            Vec::new()
        }
    }
}
