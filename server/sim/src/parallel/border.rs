//! The border of a rank's part: which elements other ranks need of it, and which it needs of them.

use super::{
    communicator::{Communicator, Message},
    spare::Spare,
};
use crate::math::Bytes;

/// What goes over the borders of a part, in both directions.
#[derive(Debug)]
pub(crate) struct Border {
    neighbours: Vec<Neighbour>,
    /// The messages of an exchange, with the bytes that it sends of each element.
    messages: Spare<Vec<(usize, Vec<Message>)>>,
}

/// A rank at the other side.
#[derive(Debug)]
struct Neighbour {
    rank: usize,
    /// Own elements that it needs, ascending.
    sent: Vec<u32>,
    /// Its elements that are needed here, ascending.
    received: Vec<u32>,
}

impl Neighbour {
    fn message(&self, bytes: usize) -> Message {
        let [sent, received] = [&self.sent, &self.received].map(|list| vec![0; list.len() * bytes]);
        Message { rank: self.rank, sent, received }
    }
}

impl Border {
    /// That of `rank`, one of `size`, between elements that are joined by pairs: each pair both ways or one, some more than
    /// once.
    pub(super) fn between(
        pairs: impl Iterator<Item = [u32; 2]>,
        owner: impl Fn(u32) -> usize,
        rank: usize,
        size: usize,
    ) -> Self {
        let mut lists = vec![[Vec::new(), Vec::new()]; size];
        for pair in pairs {
            let owners = pair.map(&owner);
            if owners[0] == owners[1] {
                continue;
            }
            for (own, other) in [(0, 1), (1, 0)] {
                if owners[own] == rank {
                    let [sent, received] = &mut lists[owners[other]];
                    sent.push(pair[own]);
                    received.push(pair[other]);
                }
            }
        }
        Self::of(lists)
    }

    /// That over which elements go to other ranks, and come from them: two lists for each rank, in which an element may stand
    /// more than once. A rank has in its first list what another has in its second.
    pub(crate) fn of(lists: Vec<[Vec<u32>; 2]>) -> Self {
        let neighbour = |(rank, lists): (usize, [Vec<u32>; 2])| {
            let [sent, received] = lists.map(|mut list| {
                list.sort_unstable();
                list.dedup();
                list
            });
            let has_any = !sent.is_empty() || !received.is_empty();
            has_any.then_some(Neighbour { rank, sent, received })
        };
        let neighbours = lists.into_iter().enumerate().filter_map(neighbour).collect();
        Self { neighbours, messages: Spare::default() }
    }

    /// Each rank at the other side, with what is sent to it and what is received from it.
    pub(crate) fn sides(&self) -> impl Iterator<Item = (usize, [&[u32]; 2])> {
        self.neighbours.iter().map(|neighbour| (neighbour.rank, [&*neighbour.sent, &neighbour.received]))
    }

    /// Writes what neighbours computed of some fields where own elements read it.
    pub(super) fn exchange<T: Bytes, const N: usize>(
        &self,
        communicator: &dyn Communicator,
        mut fields: [&mut [T]; N],
    ) {
        let mut kept = self.messages.take();
        let bytes = N * T::BYTES;
        let place = kept.iter().position(|(of_each, _)| *of_each == bytes).unwrap_or_else(|| {
            kept.push((bytes, self.neighbours.iter().map(|neighbour| neighbour.message(bytes)).collect()));
            kept.len() - 1
        });
        let messages = &mut kept[place].1;
        for (neighbour, message) in self.neighbours.iter().zip(&mut *messages) {
            let mut places = message.sent.chunks_exact_mut(T::BYTES);
            for field in &fields {
                for (element, bytes) in neighbour.sent.iter().zip(&mut places) {
                    field[*element as usize].write(bytes);
                }
            }
        }
        communicator.exchange(messages);
        for (neighbour, message) in self.neighbours.iter().zip(messages) {
            let mut places = message.received.chunks_exact(T::BYTES);
            for field in &mut fields {
                for (element, bytes) in neighbour.received.iter().zip(&mut places) {
                    field[*element as usize] = T::read(bytes);
                }
            }
        }
        self.messages.put(kept);
    }
}

#[cfg(test)]
mod tests {
    use super::Border;

    #[test]
    fn both_sides_of_a_border_know_what_goes_over_it() {
        // A ring of 12 particles in blocks of two, on three ranks.
        let pairs = || (0..12_u32).map(|i| [i, (i + 1) % 12]);
        let owner = |particle: u32| particle as usize / 4;
        let of = |rank| Border::between(pairs(), owner, rank, 3);
        for rank in 0..3 {
            for (other, [sent, received]) in of(rank).sides() {
                let back = of(other);
                let back = back.sides().find(|(other, _)| *other == rank).expect("neighbours are mutual");
                assert_eq!((sent, received), (back.1[1], back.1[0]));
                assert_eq!(sent.len(), 1);
            }
            assert_eq!(of(rank).sides().count(), 2);
        }
    }
}
