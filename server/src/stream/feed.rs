//! From the stepper to the watchers: the newest frame, the history behind it, how the streams end.
//!
//! Enters: frames from the stepper, which never waits for a watcher. Leaves: shared frames, to
//! each watcher at its own pace. A watcher of every frame keeps a number and looks it up here.

use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Instant,
};

use nappe_proto::v1;
use tokio::sync::watch;

use super::{
    demand::{Demand, Wish},
    fields::FieldSet,
    frame::EncodedFrame,
    history::{History, Lookup},
};
use crate::error::ServiceError;

/// How a session's streams end.
#[derive(Clone, Debug)]
pub(crate) enum Ending {
    /// The simulation came to its end.
    Finished(v1::SessionEnd),
    /// The session failed or was deleted.
    Broken(ServiceError),
}

/// What watchers wait for.
#[derive(Clone, Debug)]
pub(crate) struct Newest {
    pub frame: Arc<EncodedFrame>,
    /// Number of the oldest frame kept.
    pub oldest: u64,
    /// Set once, when no frame will follow.
    pub ending: Option<Arc<Ending>>,
}

/// The frames of a session on their way to its watchers.
#[derive(Debug)]
pub(crate) struct Feed {
    history: Mutex<History>,
    newest: watch::Sender<Newest>,
    demand: Arc<Demand>,
}

impl Feed {
    /// A feed with its first frame. It keeps up to `budget` bytes of frames, and always the newest.
    pub(crate) fn new(first: EncodedFrame, budget: u64) -> Self {
        let first = Arc::new(first);
        let newest = Newest { frame: Arc::clone(&first), oldest: first.head.frame, ending: None };
        let mut history = History::new(budget);
        history.push(first);

        Self { history: Mutex::new(history), newest: watch::Sender::new(newest), demand: Arc::default() }
    }

    /// Adds the next frame, or replaces the newest by itself with more fields.
    pub(crate) fn publish(&self, frame: EncodedFrame) {
        let frame = Arc::new(frame);
        let (oldest, outdated) = {
            let mut history = self.lock();
            let outdated = history.push(Arc::clone(&frame));
            (history.oldest(), outdated)
        };

        self.newest.send_modify(|newest| {
            newest.frame = frame;
            newest.oldest = oldest;
        });

        // Frames are freed here, outside the lock that watchers take.
        drop(outdated);
    }

    /// Ends the streams; later ends are ignored.
    pub(crate) fn end(&self, ending: Ending) {
        self.newest.send_modify(|newest| {
            newest.ending.get_or_insert_with(|| Arc::new(ending));
        });
    }

    /// Follows the newest frame.
    pub(crate) fn subscribe(&self) -> watch::Receiver<Newest> {
        self.newest.subscribe()
    }

    pub(crate) fn newest(&self) -> Newest {
        self.newest.borrow().clone()
    }

    /// Frame `number` if it holds what is `wanted`.
    pub(crate) fn lookup(&self, number: u64, wanted: FieldSet) -> Lookup {
        self.lock().lookup(number, wanted)
    }

    /// Asks that frames hold these fields for as long as the wish lasts; true if they did not.
    pub(crate) fn wish(&self, fields: FieldSet) -> (Wish, bool) {
        self.demand.wish(fields)
    }

    /// What a frame that is made now must hold.
    pub(crate) fn demand(&self) -> FieldSet {
        self.demand.at(Instant::now())
    }

    fn lock(&self) -> MutexGuard<'_, History> {
        // No code that holds the lock can leave the history half changed.
        self.history.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
