//! The part of a body that a rank computes: a range of its blocks. Numbers, fields and rows are those of the whole body on
//! every rank; what neighbours compute is written where it belongs by an exchange, and sums keep the tree of the whole.

use std::{ops::Range, sync::Arc};

use super::{
    block_count,
    border::Border,
    communicator::Ranks,
    each::Own,
    party::{Lists, Party, ends},
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
        let owner = |particle: u32| ends.partition_point(|end| *end <= particle as usize / block_size);
        let border = Border::new(pairs, owner, rank, size);
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
        mut each: impl FnMut([f64; M]),
    ) -> [f64; K] {
        let Some(party) = &self.party else {
            each(told);
            return sum_by(partials, of);
        };
        let read = |lists: &mut Lists| (0..party.size()).for_each(|rank| each(lists.next(rank)));
        let length = |_| <[f64; M]>::BYTES;
        party.sum_and(&self.own, (partials, of), |lists| lists.tell(&told), length, read)
    }

    /// Writes what neighbours computed of some fields where own rows read it.
    pub(crate) fn exchange<R: Real, const N: usize>(&self, fields: [&mut [Padded<R>]; N]) {
        if let Some(party) = &self.party {
            party.border.exchange(&*party.ranks.communicator, fields);
        }
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
