//! What a server has done since its start, counted for whoever watches over it.

use std::sync::atomic::{AtomicU64, Ordering};

/// A number that only grows. Threads count in it without waiting for each other.
#[derive(Debug, Default)]
pub(crate) struct Counter(AtomicU64);

/// Everything that is counted.
#[derive(Debug, Default)]
pub(crate) struct Counters {
    /// Steps that sessions took.
    pub steps: Counter,
    /// Sessions that failed.
    pub failures: Counter,
    /// Bytes written to connections.
    pub sent_bytes: Counter,
}

impl Counter {
    pub(crate) fn add(&self, count: u64) {
        self.0.fetch_add(count, Ordering::Relaxed);
    }

    pub(crate) fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}
