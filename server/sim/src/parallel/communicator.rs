//! What ranks of a cluster ask of each other while they step one simulation together.

use std::{fmt::Debug, sync::Arc};

use crate::interrupt::Interrupt;

/// How the ranks that step one simulation talk. All of them make the same calls in the same order, from one thread each.
/// A rank that is lost ends the others: no call says so.
pub trait Communicator: Debug + Send + Sync {
    /// The number of this one, from 0.
    fn rank(&self) -> usize;

    /// How many there are.
    fn size(&self) -> usize;

    /// Puts the bytes of all ranks into `all`, in their order: `own` are those of this one, `lengths` has how many each has.
    fn all_gather(&self, own: &[u8], lengths: &[usize], all: &mut Vec<u8>);

    /// Sends a message to each of some ranks, and receives one from each.
    fn exchange(&self, messages: &mut [Message]);

    /// From how many blocks of a body on ranks divide work on its coarse space that they could as well all do: it costs two
    /// more calls in each iteration of a solve. Either way has the same bits.
    fn divides_from(&self) -> usize {
        64
    }

    /// What the parts of snow are drawn from that ranks begin with; none: they are about equal. Either way has the same bits.
    fn parts_drawn_from(&self) -> Option<u64> {
        None
    }

    /// Sends `own` to rank 0, which gets what all sent, in the order of ranks; `lengths` has how long each is. The others
    /// get nothing.
    fn gather(&self, own: &[u8], lengths: &[usize]) -> Vec<u8>;
}

/// What goes to a rank, and what comes from it.
#[derive(Clone, Debug, Default)]
pub struct Message {
    /// The rank at the other end.
    pub rank: usize,
    /// Bytes for it.
    pub sent: Vec<u8>,
    /// Room for as many bytes as come from it.
    pub received: Vec<u8>,
}

/// The ranks that step one simulation, and their agreement on giving up.
#[derive(Clone, Debug)]
pub(crate) struct Ranks {
    pub(crate) communicator: Arc<dyn Communicator>,
    /// Asked for on this rank.
    pub(crate) wanted: Interrupt,
    /// Asked for on any of them, as all know since the same gather.
    pub(crate) agreed: Interrupt,
}

impl Ranks {
    pub(crate) fn new(communicator: Arc<dyn Communicator>) -> Self {
        Self { communicator, wanted: Interrupt::default(), agreed: Interrupt::default() }
    }

    /// How many there are, and the number of this one.
    pub(crate) fn size_and_rank(&self) -> (usize, usize) {
        (self.communicator.size(), self.communicator.rank())
    }

    /// Sends bytes to rank 0, which gets those of all in their order; the others get nothing.
    pub(crate) fn gather(&self, own: &[u8]) -> Vec<u8> {
        let mut lengths = Vec::new();
        let told = (own.len() as u64).to_le_bytes();
        self.communicator.all_gather(&told, &vec![told.len(); self.communicator.size()], &mut lengths);
        let lengths = lengths.as_chunks().0.iter().map(|length| u64::from_le_bytes(*length) as usize);
        self.communicator.gather(own, &lengths.collect::<Vec<_>>())
    }
}
