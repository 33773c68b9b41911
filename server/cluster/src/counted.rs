//! A communicator that counts what it is asked.

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering::Relaxed},
};

use nappe_sim::parallel::{Communicator, Message};

use crate::{cluster::Cluster, message::Asked};

/// A communicator that counts what it is asked.
#[derive(Debug)]
pub(crate) struct Counted {
    inner: Arc<dyn Cluster>,
    gathers: AtomicU64,
    messages: AtomicU64,
    bytes: AtomicU64,
    /// Begins and ends of calls so far: odd within one.
    bounds: AtomicU64,
}

impl Counted {
    pub(crate) fn new(inner: Arc<dyn Cluster>) -> Self {
        let [gathers, messages, bytes, bounds] = [(); 4].map(|()| AtomicU64::new(0));
        Self { inner, gathers, messages, bytes, bounds }
    }

    /// Begins and ends of calls so far: as long as it stays at one odd number, one call waits for the others.
    pub(crate) fn bounds(&self) -> u64 {
        self.bounds.load(Relaxed)
    }

    /// Hands what rank 0 has to all others.
    pub(crate) fn broadcast(&self, bytes: &mut Vec<u8>) {
        self.within(|cluster| cluster.broadcast(bytes));
    }

    fn within<T>(&self, call: impl FnOnce(&dyn Cluster) -> T) -> T {
        self.bounds.fetch_add(1, Relaxed);
        let result = call(&*self.inner);
        self.bounds.fetch_add(1, Relaxed);
        result
    }

    /// What it was asked so far.
    pub(crate) fn asked(&self) -> Asked {
        let [gathers, messages, bytes] =
            [&self.gathers, &self.messages, &self.bytes].map(|count| count.load(Relaxed));
        Asked { gathers, messages, bytes }
    }
}

impl Communicator for Counted {
    fn rank(&self) -> usize {
        self.inner.rank()
    }

    fn size(&self) -> usize {
        self.inner.size()
    }

    fn all_gather(&self, own: &[u8], lengths: &[usize], all: &mut Vec<u8>) {
        self.gathers.fetch_add(1, Relaxed);
        self.within(|cluster| cluster.all_gather(own, lengths, all));
    }

    fn divides_from(&self) -> usize {
        self.inner.divides_from()
    }

    fn parts_drawn_from(&self) -> Option<u64> {
        self.inner.parts_drawn_from()
    }

    fn exchange(&self, messages: &mut [Message]) {
        self.messages.fetch_add(messages.len() as u64, Relaxed);
        let bytes: u64 = messages.iter().fold(0, |bytes, message| bytes + message.sent.len() as u64);
        self.bytes.fetch_add(bytes, Relaxed);
        self.within(|cluster| cluster.exchange(messages));
    }

    fn gather(&self, own: &[u8], lengths: &[usize]) -> Vec<u8> {
        self.within(|cluster| cluster.gather(own, lengths))
    }
}
