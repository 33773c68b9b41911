//! The handle of a session, which the service holds.
//!
//! Enters: calls. Leaves: what the session's control accepts of them, and what can be read while it steps.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use nappe_proto::v1;
use nappe_sim::world::Change;
use tokio::{
    sync::{OwnedSemaphorePermit, Semaphore, oneshot},
    time::timeout,
};
use tokio_util::sync::CancellationToken;

use super::{
    control::{Control, StepOrder, Steps},
    desk::Copied,
    failure::interrupted,
    frame_room::FrameRoom,
    lease::Lease,
    pending_changes::{Accepted, PendingChange},
    status::{Properties, Status},
    waiting::Answer,
};
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
    stream::{EncodedFrame, Feed, FieldSet, Wish},
};

/// Time in which a step in progress may still end before a stop gives it up.
const STOP_PATIENCE: Duration = Duration::from_millis(250);

/// When a call is answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum When {
    /// Once it is accepted.
    Accepted,
    /// Once what it asks for has happened.
    Done,
}

impl From<bool> for When {
    /// As the field `wait` of a request says.
    fn from(wait: bool) -> Self {
        if wait { Self::Done } else { Self::Accepted }
    }
}

/// The handle of a session.
#[derive(Debug)]
pub(crate) struct Session {
    pub(super) status: Arc<Status>,
    /// What its streams begin with, in pieces.
    topology: Vec<v1::Topology>,
    pub(super) control: Arc<Control>,
    watcher_slots: Arc<Semaphore>,
    watcher_limit: u32,
    lease: Lease,
    frame_room: FrameRoom,
    /// Cancelled when the thread has ended.
    ended: CancellationToken,
}

impl Session {
    pub(super) fn new(
        status: Arc<Status>,
        topology: Vec<v1::Topology>,
        control: Arc<Control>,
        (frame_room, ended): (FrameRoom, CancellationToken),
        limits: &Limits,
    ) -> Self {
        let watcher_limit = limits.max_watchers_per_session;
        let watcher_slots = Arc::new(Semaphore::new(watcher_limit as usize));
        let lease = Lease::new(
            (limits.idle_session_seconds > 0)
                .then(|| Duration::from_secs(limits.idle_session_seconds.into())),
        );
        Self { status, topology, control, watcher_slots, watcher_limit, lease, frame_room, ended }
    }

    /// Begins the lease anew, since somebody calls.
    pub(crate) fn touch(&self) {
        self.lease.renew(Instant::now());
    }

    /// What is left of its lease: none if it has none, or is in use.
    pub(crate) fn lease_left(&self) -> Option<Duration> {
        let now = Instant::now();
        if self.watcher_count() > 0 || self.control.is_stepping() {
            self.lease.renew(now);
            return None;
        }
        self.lease.left(now)
    }

    pub(crate) fn id(&self) -> &str {
        &self.status.properties.id
    }

    /// What no other session ever has.
    pub(crate) fn uid(&self) -> &str {
        &self.status.properties.uid
    }

    /// The session itself, if it has this uid; an empty one fits every session.
    ///
    /// # Errors
    /// If it is another session, which was given the id later.
    pub(crate) fn expect_uid(&self, uid: &str) -> Result<(), ServiceError> {
        let (id, own) = (self.id(), &self.status.properties.uid);
        if uid.is_empty() || uid == own {
            return Ok(());
        }
        let message = format!("session '{id}' has the uid {own}, not {uid}: it was made later");
        Err(ServiceError::new(Reason::SessionReplaced, message)
            .with("session_id", id)
            .with("session_uid", own)
            .with("expected_uid", uid))
    }

    /// Its description as of now.
    pub(crate) fn describe(&self) -> v1::Session {
        self.with_watchers(self.status.describe())
    }

    /// Steps that it has taken.
    pub(crate) fn step_count(&self) -> u64 {
        self.status.progress().step
    }

    /// Particles of cloth and snow together.
    pub(crate) fn particle_count(&self) -> u64 {
        self.status.properties.particle_count
    }

    /// Memory of the server that is counted for it (bytes).
    pub(crate) fn claimed_bytes(&self) -> u64 {
        self.status.properties.claimed_bytes
    }

    /// What its streams begin with, in pieces.
    pub(crate) fn topology(&self) -> &[v1::Topology] {
        &self.topology
    }

    /// Side of the cells of its snow's grid (m); none without snow.
    pub(crate) fn snow_cell(&self) -> Option<f64> {
        self.status.properties.snow_cell
    }

    pub(crate) fn feed(&self) -> &Arc<Feed> {
        &self.status.feed
    }

    /// Room for one more watcher, as long as the permit is held.
    ///
    /// # Errors
    /// If it has as many as are allowed.
    pub(crate) fn watcher_slot(&self) -> Result<OwnedSemaphorePermit, ServiceError> {
        Arc::clone(&self.watcher_slots).try_acquire_owned().map_err(|_full| {
            let (id, allowed) = (self.id(), self.watcher_limit);
            let message = format!("session '{id}' has {allowed} watchers; allowed: at most {allowed}");
            ServiceError::new(Reason::TooManyWatchers, message)
                .with("session_id", id)
                .with("allowed", allowed)
        })
    }

    /// Steps at `real_time_factor` simulated seconds per second; 0: as fast as possible.
    ///
    /// # Errors
    /// If the session is at its end.
    pub(crate) fn play(&self, real_time_factor: f64) -> Result<v1::Session, ServiceError> {
        self.control.play(real_time_factor).map(|session| self.with_watchers(session))
    }

    /// Pauses after the step in progress. Returns the session, and the steps that it will have taken then.
    ///
    /// # Errors
    /// If too many calls wait, or the session ends meanwhile.
    pub(crate) async fn pause(&self, when: When) -> Result<(v1::Session, u64), ServiceError> {
        let (answer, paused) = place(when);
        let (session, step) = self.control.pause(answer)?;
        Ok((self.after(paused, session).await?, step))
    }

    /// Makes changes and takes steps, then pauses. With fields, the frame after the steps comes too.
    ///
    /// # Errors
    /// If the session is playing or at its end, a change is refused, too many calls wait, the steps are cut short, or
    /// the session has gone on before the frame was made.
    pub(crate) async fn step(
        &self,
        steps: Steps,
        changes: Vec<Change>,
        frame: Option<FieldSet>,
        when: When,
    ) -> Result<(v1::Session, Option<v1::Frame>), ServiceError> {
        // Steps that are taken already change nothing.
        if !matches!(steps, Steps::Until(step) if step <= self.step_count()) {
            self.control.try_out(0, &changes).await?;
        }
        let (answer, stepped) = place(when);
        let (done, made) = oneshot::channel();
        let frame_to = frame.map(|fields| (fields, done));
        let session = self.control.step(StepOrder { steps, changes, frame: frame_to }, answer)?;
        let session = self.after(stepped, session).await?;

        let Some(fields) = frame else { return Ok((session, None)) };
        let made: Result<Arc<EncodedFrame>, _> = made.await;
        let made = made.map_err(|_unmade| self.unmade(session.step))?;
        Ok((session, Some(made.whole(fields))))
    }

    /// A copy of the session between two steps.
    ///
    /// # Errors
    /// If it failed or stands within a step that was given up, too many calls wait, or it is deleted meanwhile.
    pub(super) async fn copy(&self) -> Result<(Properties, Copied), ServiceError> {
        let copied = self.control.copy()?.await.map_err(|_gone| self.untaken())?;
        Ok((self.status.properties.clone(), copied))
    }

    /// Ends the simulation; a step that takes long is given up.
    ///
    /// # Errors
    /// If too many calls wait, or the session is deleted meanwhile.
    pub(crate) async fn stop(&self) -> Result<v1::Session, ServiceError> {
        let (answer, mut stopped) = oneshot::channel();
        self.control.stop(answer)?;
        let answer = loop {
            match timeout(STOP_PATIENCE, &mut stopped).await {
                Ok(answer) => break answer,
                // What was done before is done again first.
                Err(_elapsed) if self.control.is_rerunning() => {}
                Err(_elapsed) => {
                    self.control.interrupt();
                    break stopped.await;
                }
            }
        };
        let session = answer.map_err(|_gone| self.gone())??;
        Ok(self.with_watchers(session))
    }

    /// Changes parameters before step `at_step`, or before the first that has not begun.
    ///
    /// # Errors
    /// If a change is refused, too many calls or changes wait, or the session ends meanwhile.
    pub(crate) async fn update(
        &self,
        at_step: u64,
        changes: Vec<Change>,
        when: When,
    ) -> Result<Accepted, ServiceError> {
        self.control.try_out(at_step, &changes).await?;
        let (answer, applied) = place(when);
        let accepted = self.control.update(at_step, changes, answer)?;
        if let Some(applied) = applied {
            applied.await.map_err(|_gone| self.gone())??;
        }
        Ok(accepted)
    }

    /// Puts the session back to its start, between two steps.
    ///
    /// # Errors
    /// If it is at its end, too many calls wait, or it ends meanwhile.
    pub(crate) async fn reset(&self) -> Result<Accepted, ServiceError> {
        self.control.reset()?.await.map_err(|_gone| self.gone())
    }

    /// Up to `count` of the changes that wait, after one, and the last of them if more follow.
    pub(crate) fn pending_changes(
        &self,
        after: Option<Accepted>,
        count: usize,
    ) -> (Vec<PendingChange>, Option<Accepted>) {
        self.control.pending_changes(after, count)
    }

    /// How many changes wait.
    pub(crate) fn pending_count(&self) -> u64 {
        self.control.pending_count() as u64
    }

    /// Drops changes that wait, those of these orders or all, and returns how many calls had made them.
    pub(crate) fn drop_changes(&self, orders: Option<&[u64]>) -> u64 {
        self.control.drop_changes(orders)
    }

    /// Asks that frames hold these fields while the wish lasts, the newest one too if its state still stands.
    ///
    /// # Errors
    /// If the server has no memory for them, too many calls wait, or the session fails or is deleted meanwhile.
    pub(crate) async fn provide(&self, fields: FieldSet) -> Result<Wish, ServiceError> {
        self.frame_room.make(self.feed().demand().union(fields))?;
        let (wish, _) = self.feed().wish(fields);
        if !self.feed().newest().frame.fields().covers(fields)
            && let Some(completed) = self.control.complete_newest()?
            && completed.await.is_err()
        {
            self.check_failure()?;
        }
        Ok(wish)
    }

    /// Tells the thread to end, within the step in progress; nothing of the session is kept.
    pub(crate) fn end(&self) {
        self.control.delete();
    }

    /// Whether it was told to end.
    pub(crate) fn is_ending(&self) -> bool {
        self.control.is_deleted()
    }

    /// Waits until the thread has ended and its memory is free.
    pub(crate) async fn ended(&self) {
        self.ended.cancelled().await;
    }

    /// Makes what the thread does next panic, as a bug would: for tests of isolation.
    #[doc(hidden)]
    pub(crate) fn inject_panic(&self) {
        self.control.inject_panic();
    }

    /// The session once what a call waits for has happened, or as it is.
    async fn after(
        &self,
        happened: Option<oneshot::Receiver<Result<v1::Session, ServiceError>>>,
        session: v1::Session,
    ) -> Result<v1::Session, ServiceError> {
        let session = match happened {
            Some(happened) => happened.await.map_err(|_gone| self.gone())??,
            None => session,
        };
        Ok(self.with_watchers(session))
    }

    /// Refuses what a panic has cut short, since the session failed of it.
    fn check_failure(&self) -> Result<(), ServiceError> {
        let failure = self.status.progress().failure;
        let panicked = failure.filter(|failure| failure.reason == Reason::SessionPanicked.name());
        panicked.map_or(Ok(()), |failure| {
            Err(ServiceError::new(Reason::SessionPanicked, failure.message).with("session_id", self.id()))
        })
    }

    /// Why a state that was asked for was not taken.
    pub(super) fn untaken(&self) -> ServiceError {
        if self.is_ending() {
            return self.gone();
        }
        let id = self.id();
        let message = format!(
            "session '{id}' stands within a step that was given up or failed: it cannot be copied or saved"
        );
        ServiceError::new(Reason::SessionFailed, message).with("session_id", id)
    }

    /// A frame of an answer that was not made, of a session that had taken so many steps.
    fn unmade(&self, step: u64) -> ServiceError {
        if self.is_ending() { self.gone() } else { interrupted(self.id(), step) }
    }

    fn gone(&self) -> ServiceError {
        ServiceError::session_deleted(self.id())
    }

    fn with_watchers(&self, mut session: v1::Session) -> v1::Session {
        session.watcher_count = self.watcher_count();
        session.expires_in_seconds = self.lease_left().map(|left| left.as_secs_f64());
        session.durability = self.control.durability();
        session
    }

    fn watcher_count(&self) -> u32 {
        self.watcher_limit - self.watcher_slots.available_permits() as u32
    }
}

/// A place for the answer of a call that waits.
fn place(when: When) -> (Option<Answer>, Option<oneshot::Receiver<Result<v1::Session, ServiceError>>>) {
    match when {
        When::Accepted => (None, None),
        When::Done => {
            let (answer, happened) = oneshot::channel();
            (Some(answer), Some(happened))
        }
    }
}
