//! Frames out: the newest in a slot, and a bounded history behind it.
//!
//! Enters: frames from the stepper, which never waits for a watcher. Leaves: shared frames, to
//! each watcher at its own pace. A watcher of every frame holds a number and looks it up here.

use std::{
    collections::VecDeque,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU16, Ordering},
    },
};

use nappe_proto::v1;
use tokio::sync::watch;

use super::{fields::Contents, frame::EncodedFrame};
use crate::error::ServiceError;

/// How a session's streams end.
#[derive(Clone, Debug)]
pub(crate) enum Ending {
    /// The simulation came to its end.
    Finished(v1::SessionEnd),
    /// It failed, or was deleted.
    Broken(ServiceError),
}

/// What watchers wait for: the newest frame, the oldest number kept, the end.
#[derive(Clone, Debug)]
pub(crate) struct Newest {
    /// The newest frame.
    pub frame: Arc<EncodedFrame>,
    /// Number of the oldest frame kept.
    pub oldest: u64,
    /// Set once, when no frame will follow.
    pub ending: Option<Arc<Ending>>,
}

/// What a look into the history finds.
#[derive(Clone, Debug)]
pub(crate) enum Lookup {
    /// The frame.
    Found(Arc<EncodedFrame>),
    /// It is not made yet.
    NotYet,
    /// It is no longer kept, or not with what is asked for; this is the oldest that is.
    Expired {
        /// Frame number.
        oldest: u64,
    },
}

/// The way of a session's frames to its watchers.
#[derive(Debug)]
pub(crate) struct Feed {
    history: Mutex<History>,
    newest: watch::Sender<Newest>,
    /// What frames from now on must hold: what watchers ever asked for.
    demand: AtomicU16,
}

impl Feed {
    /// A feed with its first frame, keeping up to `budget` bytes of frames, and always one.
    pub(crate) fn new(first: EncodedFrame, budget: u64) -> Self {
        let first = Arc::new(first);
        let newest = Newest { frame: Arc::clone(&first), oldest: first.head.frame, ending: None };
        let mut history = History { frames: VecDeque::new(), bytes: 0, budget };
        history.push(first);
        Self {
            history: Mutex::new(history),
            newest: watch::Sender::new(newest),
            demand: AtomicU16::new(Contents::ALWAYS.bits()),
        }
    }

    /// Adds the next frame, or replaces the newest by itself with more in it.
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

    /// The newest frame.
    pub(crate) fn newest(&self) -> Newest {
        self.newest.borrow().clone()
    }

    /// Frame `number` if it holds what is `wanted`.
    pub(crate) fn lookup(&self, number: u64, wanted: Contents) -> Lookup {
        self.lock().lookup(number, wanted)
    }

    /// Asks that frames from now on hold these; true if that is new.
    pub(crate) fn ask_for(&self, contents: Contents) -> bool {
        let before = self.demand.fetch_or(contents.bits(), Ordering::Relaxed);
        !Contents::from_bits(before).covers(contents)
    }

    /// What frames must hold now.
    pub(crate) fn demand(&self) -> Contents {
        Contents::from_bits(self.demand.load(Ordering::Relaxed))
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, History> {
        // No code that holds the lock can leave the history half changed.
        self.history.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Frames without gaps, oldest first, within a budget of bytes.
#[derive(Debug)]
struct History {
    frames: VecDeque<Arc<EncodedFrame>>,
    bytes: u64,
    budget: u64,
}

impl History {
    fn oldest(&self) -> u64 {
        self.frames.front().map_or(0, |frame| frame.head.frame)
    }

    /// Adds a frame and returns what made room for it.
    fn push(&mut self, frame: Arc<EncodedFrame>) -> Vec<Arc<EncodedFrame>> {
        let mut outdated = Vec::new();
        if self.frames.back().is_some_and(|newest| newest.head.frame == frame.head.frame) {
            outdated.extend(self.frames.pop_back());
        }
        self.bytes += frame.size() as u64;
        self.frames.push_back(frame);
        self.bytes -= outdated.iter().map(|frame| frame.size() as u64).sum::<u64>();
        while self.bytes > self.budget && self.frames.len() > 1 {
            let frame = self.frames.pop_front().expect("there is more than one");
            self.bytes -= frame.size() as u64;
            outdated.push(frame);
        }
        outdated
    }

    fn lookup(&self, number: u64, wanted: Contents) -> Lookup {
        if self.frames.back().is_none_or(|newest| newest.head.frame < number) {
            return Lookup::NotYet;
        }
        let found = number
            .checked_sub(self.oldest())
            .and_then(|index| self.frames.get(index as usize))
            .filter(|frame| frame.contents().covers(wanted));
        if let Some(frame) = found {
            return Lookup::Found(Arc::clone(frame));
        }
        // Contents are only ever added to the demand, so that frames which have them are the newest
        // ones; the initial frame, which has all, may stand apart at the front.
        let complete = self.frames.iter().rev().take_while(|frame| frame.contents().covers(wanted)).count();
        let next = self.frames.back().map_or(0, |newest| newest.head.frame + 1);
        Lookup::Expired { oldest: next - complete as u64 }
    }
}
