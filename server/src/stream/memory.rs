//! Memory of frames: counted for the whole server as long as anybody refers to it.
//!
//! Enters: bytes that history, watchers and connections share. Leaves: how many of them watchers hold, beyond the frames
//! that sessions keep.

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use bytes::Bytes;

/// Bytes of all frames of a server.
#[derive(Debug, Default)]
pub(crate) struct FrameMemory {
    /// Arrays that somebody refers to.
    live: AtomicU64,
    /// Those among them that sessions keep.
    kept: AtomicU64,
    /// Those among them that only watchers refer to that have ended.
    excused: AtomicU64,
}

impl FrameMemory {
    /// A session keeps so many more bytes.
    pub(super) fn keep(&self, bytes: u64) {
        self.kept.fetch_add(bytes, Ordering::Relaxed);
    }

    /// A session keeps so many bytes no longer.
    pub(super) fn let_go(&self, bytes: u64) {
        self.kept.fetch_sub(bytes, Ordering::Relaxed);
    }

    /// Bytes that are referred to by watchers alone.
    pub(crate) fn held(&self) -> u64 {
        let [kept, excused] = [&self.kept, &self.excused].map(|bytes| bytes.load(Ordering::Relaxed));
        self.live.load(Ordering::Relaxed).saturating_sub(kept.saturating_add(excused))
    }
}

/// Bytes that do not count as held until this is dropped: what watchers that ended have left to be sent.
#[derive(Debug)]
pub(super) struct Excused {
    memory: Arc<FrameMemory>,
    bytes: u64,
}

impl Excused {
    /// Excuses so many bytes, unless more than `allowed` would be excused.
    pub(super) fn new(memory: &Arc<FrameMemory>, bytes: u64, allowed: u64) -> Option<Self> {
        let add = |excused: u64| excused.checked_add(bytes).filter(|sum| *sum <= allowed);
        memory.excused.fetch_update(Ordering::Relaxed, Ordering::Relaxed, add).ok()?;
        Some(Self { memory: Arc::clone(memory), bytes })
    }
}

impl Drop for Excused {
    fn drop(&mut self) {
        self.memory.excused.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

/// Bytes that count until this is dropped.
#[derive(Debug)]
pub(super) struct Counted {
    memory: Arc<FrameMemory>,
    bytes: u64,
}

impl Counted {
    pub(super) fn new(memory: &Arc<FrameMemory>, bytes: usize) -> Self {
        memory.live.fetch_add(bytes as u64, Ordering::Relaxed);
        Self { memory: Arc::clone(memory), bytes: bytes as u64 }
    }

    /// Shares bytes that count until the last who refers to them is gone.
    pub(super) fn share(memory: &Arc<FrameMemory>, bytes: Vec<u8>) -> Bytes {
        struct Owner(Vec<u8>, #[expect(dead_code, reason = "counts until it is dropped")] Counted);

        impl AsRef<[u8]> for Owner {
            fn as_ref(&self) -> &[u8] {
                &self.0
            }
        }

        let counted = Self::new(memory, bytes.len());
        Bytes::from_owner(Owner(bytes, counted))
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        self.memory.live.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_excused_does_not_count_as_held() {
        let memory = Arc::new(FrameMemory::default());
        let shared = Counted::share(&memory, vec![1; 1000]);
        let excused = Excused::new(&memory, 1000, 1500);
        assert_eq!(memory.held(), 0);
        assert!(excused.is_some() && Excused::new(&memory, 501, 1500).is_none(), "more than is allowed");
        drop(shared);
        assert_eq!(memory.held(), 0, "never below nothing");
        drop(excused);
        let _shared = Counted::share(&memory, vec![1; 1000]);
        assert_eq!(memory.held(), 1000);
    }
}
