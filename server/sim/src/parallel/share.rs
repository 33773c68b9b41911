//! The part of a body that a rank computes: a range of its blocks. Numbers, fields and rows are those of the whole body on
//! every rank; what neighbours compute is written where it belongs by an exchange, and sums keep the tree of the whole.

use std::{ops::Range, sync::Arc};

use super::{
    block_count,
    border::Border,
    communicator::Ranks,
    each::Own,
    party::{Numbers, Party, ends, ends_of, owner},
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
        let ends = ends(whole.blocks, size);
        let owner = |particle: u32| owner(&ends, particle as usize / block_size);
        let border = Border::between(pairs, owner, rank, size);
        let party = Party::new(ranks.clone(), ends, border);
        let own = party.blocks(rank);
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
        self.sum_and_tell(partials, of, [], |[]| {})
    }

    /// Hands over what each rank tells, in their order.
    pub(crate) fn tell<const M: usize>(&self, told: [f64; M], each: impl FnMut([f64; M])) {
        self.sum_and_tell::<(), 0, M>(&[], &|()| [], told, each);
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
    pub(crate) fn sum_and_tell<T, const K: usize, const M: usize>(
        &self,
        partials: &[T],
        of: &impl Fn(&T) -> [f64; K],
        told: [f64; M],
        each: impl FnMut([f64; M]),
    ) -> [f64; K] {
        self.sum_from((partials, 0), of, told, each)
    }

    /// Adds as [`Self::sum`] does, and completes a list of which each rank has made the elements that `of_rank` says.
    pub(crate) fn sum_and_complete<T, B: Bytes, const K: usize>(
        &self,
        partials: &[T],
        of: &impl Fn(&T) -> [f64; K],
        list: &mut [B],
        of_rank: impl Fn(usize) -> Range<usize>,
    ) -> [f64; K] {
        let Some(party) = &self.party else { return sum_by(partials, of) };
        let mut lists = party.begin();
        party.tell_sums(&mut lists, &self.own, (partials, 0), of);
        list[of_rank(party.ranks.communicator.rank())].iter().for_each(|element| lists.tell(element));
        let sums = party.all_gather(&mut lists, |rank| of_rank(rank).len() * B::BYTES);
        for rank in 0..party.size() {
            list[of_rank(rank)].iter_mut().for_each(|element| *element = lists.next(rank));
        }
        party.put(lists);
        sums
    }

    /// Completes such a list.
    pub(crate) fn complete<B: Bytes>(&self, list: &mut [B], of_rank: impl Fn(usize) -> Range<usize>) {
        self.sum_and_complete::<(), B, 0>(&[], &|()| [], list, of_rank);
    }

    /// Completes a list of numbers.
    pub(crate) fn complete_numbers<const K: usize>(
        &self,
        list: &mut [[f64; K]],
        of_rank: impl Fn(usize) -> Range<usize>,
    ) {
        if self.party.is_some() {
            let mut told: Vec<_> = list.iter().map(|numbers| Numbers(*numbers)).collect();
            self.complete(&mut told, of_rank);
            list.iter_mut().zip(told).for_each(|(numbers, told)| *numbers = told.0);
        }
    }

    /// The part of a body of which each rank computes as many blocks as are counted.
    pub(crate) fn counted(ranks: &Ranks, counts: &[usize]) -> Self {
        let party = Party::new(ranks.clone(), ends_of(counts).collect(), Border::of(Vec::new()));
        let own = party.blocks(ranks.communicator.rank());
        Self { block_size: 1, blocks: counts.iter().sum(), own, party: Some(Arc::new(party)) }
    }

    /// Takes over how many blocks each rank computes from now on, of a part that was counted.
    pub(crate) fn recount(&mut self, counts: &[usize]) {
        if let Some(party) = self.party.as_mut().and_then(Arc::get_mut) {
            party.recount(counts);
            self.blocks = counts.iter().sum();
            self.own = party.blocks(party.ranks.communicator.rank());
        } else if let Some(party) = &self.party {
            // Somebody else has it too.
            let ranks = party.ranks.clone();
            *self = Self::counted(&ranks, counts);
        }
    }

    /// How many blocks the whole body has.
    pub(crate) fn block_count(&self) -> usize {
        self.blocks
    }

    /// The same as [`Self::sum_and_tell`], of a list of own blocks alone.
    pub(crate) fn sum_own_and_tell<T, const K: usize, const M: usize>(
        &self,
        partials: &[T],
        of: &impl Fn(&T) -> [f64; K],
        told: [f64; M],
        each: impl FnMut([f64; M]),
    ) -> [f64; K] {
        self.sum_from((partials, self.own.start), of, told, each)
    }

    /// The same of a list whose first element is that of block `first`.
    fn sum_from<T, const K: usize, const M: usize>(
        &self,
        (partials, first): (&[T], usize),
        of: &impl Fn(&T) -> [f64; K],
        told: [f64; M],
        mut each: impl FnMut([f64; M]),
    ) -> [f64; K] {
        let Some(party) = &self.party else {
            each(told);
            return sum_by(partials, of);
        };
        let mut lists = party.begin();
        party.tell_sums(&mut lists, &self.own, (partials, first), of);
        lists.tell(&Numbers(told));
        let sums = party.all_gather(&mut lists, |_| Numbers::<M>::BYTES);
        (0..party.size()).for_each(|rank| each(lists.next::<Numbers<M>>(rank).0));
        party.put(lists);
        sums
    }

    /// Writes what neighbours computed of some fields where own rows read it.
    pub(crate) fn exchange<R: Real, const N: usize>(&self, fields: [&mut [Padded<R>]; N]) {
        if let Some(party) = &self.party {
            party.border.exchange(&*party.ranks.communicator, fields);
        }
    }

    /// Writes what other ranks made of some lists where it is needed here.
    pub(crate) fn exchange_over<T: Bytes, const N: usize>(&self, border: &Border, lists: [&mut [T]; N]) {
        if let Some(party) = &self.party {
            border.exchange(&*party.ranks.communicator, lists);
        }
    }

    /// The numbers of all ranks, and of this one; none where it computes all.
    pub(crate) fn ranks(&self) -> Option<(Range<usize>, usize)> {
        self.party.as_ref().map(|party| (0..party.size(), party.ranks.communicator.rank()))
    }

    /// The blocks that a rank computes.
    pub(crate) fn blocks_of(&self, rank: usize) -> Range<usize> {
        self.party.as_ref().map_or(0..self.blocks, |party| party.blocks(rank))
    }

    /// The rank that computes a block.
    pub(crate) fn owner(&self, block: usize) -> usize {
        self.party.as_ref().map_or(0, |party| party.owner(block))
    }

    /// Whether ranks divide what they could as well compute alike, of a body with so many blocks.
    pub(crate) fn divides(&self) -> bool {
        self.party.as_ref().is_some_and(|party| self.blocks >= party.ranks.communicator.divides_from())
    }

    /// Completes a field on rank 0.
    pub(crate) fn gather_field<R: Real>(&self, field: &mut [Padded<R>]) {
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
        let count = |Range { start, end }: Range<usize>| rows(end) - rows(start);
        let lengths = (0..party.size()).map(|rank| count(party.blocks(rank)) * Padded::<R>::BYTES);
        party.ranks.communicator.gather(&own, &lengths.collect::<Vec<_>>())
    }
}
