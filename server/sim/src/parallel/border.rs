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

/// A rank with elements that are joined to own ones.
#[derive(Debug)]
struct Neighbour {
    rank: usize,
    /// Own elements that are joined to its, ascending.
    sent: Vec<u32>,
    /// Its elements that are joined to own ones, ascending.
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
    pub(super) fn new(
        pairs: impl Iterator<Item = [u32; 2]>,
        owner: impl Fn(u32) -> usize,
        rank: usize,
        size: usize,
    ) -> Self {
        Self { neighbours: neighbours(pairs, owner, rank, size), messages: Spare::default() }
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

/// The ranks that one shares pairs of elements with.
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
    use super::neighbours;

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
