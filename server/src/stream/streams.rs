//! What the streams of all sessions share: memory of frames, and who gives way when it is too much.
//!
//! A watcher whose message is not fetched waits here. When watchers hold more than they may, the one that has waited
//! longest ends; who waits for too long ends as well.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use tokio::sync::Semaphore;
use tokio_util::sync::CancellationToken;

use super::memory::FrameMemory;
use crate::config::core_count;

/// Time in which memory comes back after a watcher was told to end.
const RELIEF: Duration = Duration::from_millis(100);

/// What the streams of a server share.
#[derive(Debug)]
pub(crate) struct Streams {
    pub(super) memory: Arc<FrameMemory>,
    /// Permits to choose nodes of grids, one per thread that may do so.
    pub(super) choosing: Semaphore,
    /// Bytes that watchers may hold beyond what sessions keep.
    pub(super) max_held_bytes: u64,
    /// How long a message may wait to be fetched.
    pub(super) stall: Duration,
    waiting: Mutex<WaitingWatchers>,
}

#[derive(Debug, Default)]
struct WaitingWatchers {
    /// By the number of their wait, which grows: the first has waited longest.
    watchers: BTreeMap<u64, CancellationToken>,
    last: u64,
    /// When a watcher was told to end.
    relieved: Option<Instant>,
}

/// A watcher that waits until its message is fetched.
#[derive(Debug)]
pub(super) struct WaitingWatcher<'a> {
    streams: &'a Streams,
    number: u64,
}

impl Streams {
    /// Streams that hold at most `max_held_bytes`, and whose messages wait for at most `stall`.
    pub(crate) fn new(max_held_bytes: u64, stall: Duration) -> Arc<Self> {
        Arc::new(Self {
            memory: Arc::default(),
            choosing: Semaphore::new((core_count() as usize / 2).max(1)),
            max_held_bytes,
            stall,
            waiting: Mutex::default(),
        })
    }

    /// The memory of frames.
    pub(crate) fn memory(&self) -> Arc<FrameMemory> {
        Arc::clone(&self.memory)
    }

    /// Notes that a watcher waits, as long as the result lives; `leave` is cancelled if it is to end.
    pub(super) fn wait(&self, leave: &CancellationToken) -> WaitingWatcher<'_> {
        let mut waiting = self.lock();
        waiting.last += 1;
        let number = waiting.last;
        waiting.watchers.insert(number, leave.clone());
        WaitingWatcher { streams: self, number }
    }

    /// Ends the watcher that has waited longest if watchers hold too much.
    pub(super) fn relieve(&self, now: Instant) {
        if self.memory.held() <= self.max_held_bytes {
            return;
        }
        let mut waiting = self.lock();
        let is_early = waiting.relieved.is_some_and(|then| now.saturating_duration_since(then) < RELIEF);
        if !is_early && let Some((_, watcher)) = waiting.watchers.pop_first() {
            waiting.relieved = Some(now);
            watcher.cancel();
        }
    }

    fn lock(&self) -> MutexGuard<'_, WaitingWatchers> {
        // No code that holds the lock can leave it half changed.
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for WaitingWatcher<'_> {
    fn drop(&mut self) {
        self.streams.lock().watchers.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::memory::Counted;

    #[test]
    fn whoever_has_waited_longest_gives_way_when_too_much_is_held() {
        let streams = Streams::new(1000, Duration::from_secs(30));
        let leave = [(); 3].map(|()| CancellationToken::new());
        let [first, second, third] = leave.each_ref().map(|leave| streams.wait(leave));
        let held = Counted::new(&streams.memory, 1001);
        drop(first);

        let now = Instant::now();
        streams.relieve(now);
        streams.relieve(now);
        assert_eq!(leave.each_ref().map(CancellationToken::is_cancelled), [false, true, false]);
        drop((second, held));
        streams.relieve(now + RELIEF);
        assert!(!leave[2].is_cancelled(), "what is held is allowed again");
        drop(third);
        assert!(streams.lock().watchers.is_empty());
    }
}
