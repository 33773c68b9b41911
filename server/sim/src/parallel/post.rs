//! Bytes that ranks send to each other, in lists that are kept from one exchange to the next.

use super::communicator::{Message, Ranks};

/// What goes to each rank, and what comes from it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Post {
    /// One for each rank, in their order; that of this rank stays empty.
    messages: Vec<Message>,
    /// How many bytes this rank sends to each one, as it tells the others.
    told: Vec<u8>,
    /// How many bytes each rank tells, and what all of them tell.
    lengths: Vec<usize>,
    all: Vec<u8>,
}

impl Post {
    /// Begins anew: nothing goes to any of so many ranks, and nothing comes from them.
    pub(crate) fn clear(&mut self, size: usize) {
        self.messages.resize_with(size, Message::default);
        for (rank, message) in self.messages.iter_mut().enumerate() {
            message.rank = rank;
            message.sent.clear();
            message.received.clear();
        }
    }

    /// The bytes for a rank, to be added to.
    pub(crate) fn sent_to(&mut self, rank: usize) -> &mut Vec<u8> {
        &mut self.messages[rank].sent
    }

    /// Makes room for as many bytes as come from a rank.
    pub(crate) fn expect_from(&mut self, rank: usize, count: usize) {
        self.messages[rank].received.resize(count, 0);
    }

    /// What came from each rank, in their order.
    pub(crate) fn received(&self) -> impl Iterator<Item = &[u8]> {
        self.messages.iter().map(|message| &message.received[..])
    }

    /// Sends bytes to ranks that do not know how many come, and receives what they send.
    pub(crate) fn swap(&mut self, ranks: &Ranks) {
        let (size, rank) = ranks.size_and_rank();
        let Self { messages, told, lengths, all } = self;
        told.clear();
        told.extend(messages.iter().flat_map(|message| (message.sent.len() as u64).to_le_bytes()));
        lengths.clear();
        lengths.resize(size, told.len());
        ranks.communicator.all_gather(told, lengths, all);

        let counts = all.as_chunks().0;
        for (other, message) in messages.iter_mut().enumerate().filter(|(other, _)| *other != rank) {
            let count = u64::from_le_bytes(counts[other * size + rank]) as usize;
            message.received.resize(count, 0);
        }
        self.exchange(ranks);
    }

    /// Sends what there is to send, and receives as many bytes as there is room for.
    pub(crate) fn exchange(&mut self, ranks: &Ranks) {
        let is_none = |message: &Message| message.sent.is_empty() && message.received.is_empty();
        self.messages.sort_unstable_by_key(|message| (is_none(message), message.rank));
        let count = self.messages.partition_point(|message| !is_none(message));
        ranks.communicator.exchange(&mut self.messages[..count]);
        self.messages.sort_unstable_by_key(|message| message.rank);
    }
}
