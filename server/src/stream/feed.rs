//! From the stepper to the watchers: the newest frame, the history behind it, changes of state, how the streams end.
//!
//! Enters: frames and changes from the stepper, which never waits for a watcher. Leaves: shared frames, to
//! each watcher at its own pace. A watcher of every frame keeps a number and looks it up here.

use std::{
    collections::BTreeMap,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::Instant,
};

use nappe_proto::v1;
use tokio::sync::watch;
use uuid::Uuid;

use super::{
    changes::Changes,
    demand::{Demand, Wish},
    fields::FieldSet,
    frame::EncodedFrame,
    history::{History, Lookup, Needed},
    streams::Streams,
};
use crate::error::{Reason, ServiceError};

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
    /// Number of the newest change of state, 0 if there is none.
    pub change: u64,
    /// Set once, when no frame will follow.
    pub ending: Option<Arc<Ending>>,
}

/// The frames of a session on their way to its watchers.
#[derive(Debug)]
pub(crate) struct Feed {
    history: Mutex<History>,
    changes: Mutex<Changes>,
    newest: watch::Sender<Newest>,
    demand: Arc<Demand>,
    /// The next frame of each watcher that frames are kept for, by an id of its own.
    needs: Mutex<BTreeMap<Uuid, (Kept, u64)>>,
    /// The first frame that is shown to who does not ask for one by its number: those before it were seen already.
    first_shown: AtomicU64,
    streams: Arc<Streams>,
}

/// Why frames are kept for a watcher.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kept {
    /// It is still receiving the topology.
    Opening,
    /// The session waits for it.
    Paced,
}

/// Frames that are kept for a watcher, until this is dropped.
#[derive(Debug)]
pub(super) struct Need {
    feed: Arc<Feed>,
    id: Uuid,
    kept: Kept,
}

impl Need {
    /// The watcher has taken all frames before `next`.
    pub(super) fn advance(&self, next: u64) {
        self.feed.lock_needs().insert(self.id, (self.kept, next));
    }
}

impl Drop for Need {
    fn drop(&mut self) {
        self.feed.lock_needs().remove(&self.id);
    }
}

impl Feed {
    /// A feed of the session of this uid, with its first frame. It keeps up to `budget` bytes of frames, and always
    /// the newest.
    pub(crate) fn new(session_uid: &str, first: EncodedFrame, budget: u64, streams: Arc<Streams>) -> Self {
        let first = Arc::new(first);
        let newest = Newest { frame: Arc::clone(&first), oldest: first.head.frame, change: 0, ending: None };
        let mut history = History::new(budget, Arc::clone(&streams.memory));
        history.push(first, Needed { paced: u64::MAX, opening: u64::MAX });

        Self {
            history: Mutex::new(history),
            changes: Mutex::new(Changes::new(session_uid.to_owned())),
            newest: watch::Sender::new(newest),
            demand: Arc::default(),
            needs: Mutex::default(),
            first_shown: AtomicU64::new(0),
            streams,
        }
    }

    /// Shows frames from this number on, but for who asks for one before by its number: numbers never go back.
    pub(crate) fn begin_at(&self, frame: u64) {
        self.first_shown.store(frame, Ordering::Relaxed);
    }

    /// The first frame that is shown to who does not ask for one by its number.
    pub(super) fn first_shown(&self) -> u64 {
        self.first_shown.load(Ordering::Relaxed)
    }

    /// Adds the next frame, or replaces the newest by itself with more fields.
    pub(crate) fn publish(&self, frame: EncodedFrame) {
        let frame = Arc::new(frame);
        let needed = self.needed();
        let (oldest, outdated) = {
            let mut history = self.lock();
            let outdated = history.push(Arc::clone(&frame), needed);
            (history.oldest(), outdated)
        };

        self.newest.send_modify(|newest| {
            newest.frame = frame;
            newest.oldest = oldest;
        });

        // Frames are freed here, outside the lock that watchers take.
        drop(outdated);
        self.streams.relieve(Instant::now());
    }

    /// Keeps frame `next` and those after it for a watcher.
    pub(super) fn keep(self: &Arc<Self>, kept: Kept, next: u64) -> Need {
        let need = Need { feed: Arc::clone(self), id: Uuid::new_v4(), kept };
        need.advance(next);
        need
    }

    /// Whether the next frame takes the place of none that the session waits for.
    pub(crate) fn has_room(&self) -> bool {
        let needed = self.needed();
        needed.paced == u64::MAX || self.lock().has_room(needed)
    }

    /// What the streams of all sessions share.
    pub(super) fn streams(&self) -> &Arc<Streams> {
        &self.streams
    }

    fn needed(&self) -> Needed {
        let needs = self.lock_needs();
        let first = |wanted: Kept| {
            let next = needs.values().filter(|(kept, _)| *kept == wanted).map(|(_, next)| *next);
            next.min().unwrap_or(u64::MAX)
        };
        Needed { paced: first(Kept::Paced), opening: first(Kept::Opening) }
    }

    fn lock_needs(&self) -> MutexGuard<'_, BTreeMap<Uuid, (Kept, u64)>> {
        // No code that holds the lock can leave it half changed.
        self.needs.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Tells the watchers that the session is in another state after `step` steps.
    pub(crate) fn note_state(&self, state: v1::SessionState, failure: Option<v1::Failure>, step: u64) {
        self.push_change(|change| {
            change.set_kind(v1::ChangeKind::State);
            change.set_state(state);
            (change.failure, change.step) = (failure, step);
        });
    }

    /// Tells the watchers what happened to the session after `step` steps, which left it in its state.
    pub(crate) fn note(&self, kind: v1::ChangeKind, step: u64) {
        self.push_change(|change| {
            change.set_kind(kind);
            change.step = step;
        });
    }

    /// Tells the watchers what makes the results doubtful since step `step`.
    pub(crate) fn note_doubt(&self, notice: String, step: u64) {
        self.push_change(|change| {
            change.set_kind(v1::ChangeKind::Notice);
            (change.notice, change.step) = (notice, step);
        });
    }

    /// Tells the watchers of a sub-step of cloth that was not accepted, in step `step`.
    pub(crate) fn note_rejected(&self, rejected: v1::RejectedStep, step: u64) {
        self.push_change(|change| {
            change.set_kind(v1::ChangeKind::Rejected);
            (change.rejected, change.step) = (Some(rejected), step);
        });
    }

    /// Where the change stands among the frames is decided together with its number.
    fn push_change(&self, alter: impl FnOnce(&mut v1::StateChange)) {
        self.newest.send_modify(|newest| {
            let mut changes = self.lock_changes();
            let mut change = changes.present().clone();
            alter(&mut change);
            change.frame = newest.frame.head.frame;
            newest.change = changes.push(change);
        });
    }

    /// How the session stands: the last change that was pushed, as of the newest frame.
    pub(crate) fn present(&self) -> v1::StateChange {
        let mut present = self.lock_changes().present().clone();
        let head = self.newest.borrow().frame.head.clone();
        (present.frame, present.step) = (head.frame, present.step.max(head.step));
        present
    }

    /// Changes after number `after`, up to number `newest`, as far as they are kept.
    pub(crate) fn changes(&self, after: u64, newest: u64) -> Vec<v1::StateChange> {
        self.lock_changes().between(after, newest)
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

    /// Checks that a watcher of every frame can start at one: it is kept, or can still be made.
    ///
    /// # Errors
    /// A frame that is no longer kept, or beyond the last of a finished session.
    pub(crate) fn check_start(&self, from_frame: u64, wanted: FieldSet) -> Result<(), ServiceError> {
        let newest = self.newest();
        let newest_frame = newest.frame.head.frame;
        let is_finished = matches!(newest.ending.as_deref(), Some(Ending::Finished(_)));
        if is_finished && from_frame > newest_frame + 1 {
            return Err(not_made(from_frame, newest_frame));
        }

        if let Lookup::Expired { oldest } = self.lookup(from_frame, wanted) {
            let message = format!(
                "frame {from_frame} is no longer kept with what is asked for; the oldest that is: {oldest}"
            );
            return Err(ServiceError::new(Reason::FrameExpired, message)
                .with("from_frame", from_frame)
                .with("oldest_frame", oldest)
                .with("newest_frame", newest_frame));
        }
        Ok(())
    }

    /// Asks that frames hold these fields for as long as the wish lasts; true if they did not.
    pub(crate) fn wish(&self, fields: FieldSet) -> (Wish, bool) {
        self.demand.wish(fields)
    }

    /// What a frame that is made now must hold.
    pub(crate) fn demand(&self) -> FieldSet {
        self.demand.at(Instant::now())
    }

    fn lock_changes(&self) -> MutexGuard<'_, Changes> {
        // No code that holds the lock can leave it half changed.
        self.changes.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn lock(&self) -> MutexGuard<'_, History> {
        // No code that holds the lock can leave the history half changed.
        self.history.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A frame was asked for that lies beyond the last of a finished session.
pub(super) fn not_made(from_frame: u64, newest_frame: u64) -> ServiceError {
    let message =
        format!("frame {from_frame} will not be made: the session finished with frame {newest_frame}");
    ServiceError::new(Reason::FrameNotMade, message)
        .with("from_frame", from_frame)
        .with("newest_frame", newest_frame)
}
