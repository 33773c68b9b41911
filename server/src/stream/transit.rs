//! What a watcher's connection has still to send: counted until the peer takes it, and not left there for ever.
//!
//! HTTP/2 keeps what was given to it until the peer takes it, also after the watcher ended. From then on these bytes
//! are excused: no other watcher has to give way for them. What is not taken in time ends with its connection, and so
//! does what would let a server excuse more than watchers may hold.

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use tokio::{sync::watch, time::timeout};
use tokio_util::sync::CancellationToken;

use super::memory::{Counted, Excused, FrameMemory};
use crate::refusals::Call;

/// The connection of a call, which can be cut.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cut(pub CancellationToken);

/// The bytes of one watcher on their way.
#[derive(Debug)]
pub(super) struct Transit {
    memory: Arc<FrameMemory>,
    bytes: watch::Sender<u64>,
}

/// A piece of a message, until it is sent.
struct Piece {
    bytes: Bytes,
    transit: Arc<Transit>,
    /// Where the piece is memory of its own.
    _counted: Option<Counted>,
}

impl Transit {
    pub(super) fn new(memory: Arc<FrameMemory>) -> Arc<Self> {
        Arc::new(Self { memory, bytes: watch::Sender::new(0) })
    }

    /// A piece that is the frame's own memory.
    pub(super) fn lend(self: &Arc<Self>, bytes: Bytes) -> Bytes {
        self.carry(bytes, None)
    }

    /// A piece in memory of its own.
    pub(super) fn give(self: &Arc<Self>, bytes: Bytes) -> Bytes {
        let counted = Counted::new(&self.memory, bytes.len());
        self.carry(bytes, Some(counted))
    }

    fn carry(self: &Arc<Self>, bytes: Bytes, counted: Option<Counted>) -> Bytes {
        self.bytes.send_modify(|sum| *sum += bytes.len() as u64);
        Bytes::from_owner(Piece { bytes, transit: Arc::clone(self), _counted: counted })
    }

    /// The watcher of a call ended: waits until all is sent, and cuts the connection if that takes longer than `time`,
    /// or if more than `allowed` bytes would be excused.
    pub(super) async fn end(&self, call: &Call, cut: &Cut, allowed: u64, time: Duration) {
        let mut bytes = self.bytes.subscribe();
        let left = *bytes.borrow_and_update();
        let excused = Excused::new(&self.memory, left, allowed);
        // The sender lives as long as `self`: only the time can end the wait early.
        let is_sent = excused.is_some() && timeout(time, bytes.wait_for(|bytes| *bytes == 0)).await.is_ok();
        if !is_sent {
            let (session, caller) = (call.session(), call.caller());
            let why = "its peer does not take what a watcher left";
            tracing::info!(session, %caller, bytes = left, "a connection is cut: {why}");
            cut.0.cancel();
        }
    }
}

impl AsRef<[u8]> for Piece {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

impl Drop for Piece {
    fn drop(&mut self) {
        self.transit.bytes.send_modify(|sum| *sum -= self.bytes.len() as u64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHORT: Duration = Duration::from_millis(50);

    #[tokio::test]
    async fn a_connection_is_cut_unless_all_is_sent_in_time() {
        let memory = Arc::new(FrameMemory::default());
        let frame = Counted::share(&memory, vec![1; 600]);
        let transit = Transit::new(Arc::clone(&memory));
        let (array, head) = (transit.lend(frame.clone()), transit.give(Bytes::from_static(&[2; 400])));
        assert_eq!((array.as_ptr(), memory.held()), (frame.as_ptr(), 1000));

        let (call, cut) = (Call::default(), Cut::default());
        let end = transit.end(&call, &cut, 1000, SHORT * 2000);
        let take = async {
            tokio::task::yield_now().await;
            assert_eq!(memory.held(), 0, "the watcher has ended");
            drop((array, head));
        };
        tokio::join!(end, take);
        assert!(!cut.0.is_cancelled());
        assert_eq!(memory.held(), 600, "nothing is excused any more");

        let piece = transit.lend(frame);
        for (allowed, time) in [(1000, SHORT), (599, SHORT * 2000)] {
            let cut = Cut::default();
            transit.end(&call, &cut, allowed, time).await;
            assert!(cut.0.is_cancelled());
        }
        drop(piece);
    }
}
