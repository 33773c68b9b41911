//! The handle of a session, which the service holds.
//!
//! Enters: calls. Leaves: commands to the session's thread, and what can be read while it steps.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
    mpsc::{self, TrySendError},
};

use nappe_proto::v1;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, oneshot};
use tokio_util::sync::CancellationToken;

use super::{
    command::{Answer, Command, MAX_COMMANDS},
    status::Status,
};
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
    stream::{Feed, FieldSet, Wish},
};

/// The handle of a session.
#[derive(Debug)]
pub(crate) struct Session {
    status: Arc<Status>,
    /// What its streams begin with, in pieces.
    topology: Vec<v1::Topology>,
    commands: mpsc::SyncSender<Command>,
    /// Set when the session is deleted, whatever waits in the queue of commands.
    is_deleted: Arc<AtomicBool>,
    watcher_slots: Arc<Semaphore>,
    watcher_limit: u32,
    /// Cancelled when the thread has ended.
    ended: CancellationToken,
}

impl Session {
    pub(super) fn new(
        status: Arc<Status>,
        topology: Vec<v1::Topology>,
        (commands, is_deleted): (mpsc::SyncSender<Command>, Arc<AtomicBool>),
        ended: CancellationToken,
        limits: &Limits,
    ) -> Self {
        let watcher_limit = limits.max_watchers_per_session;
        let watcher_slots = Arc::new(Semaphore::new(watcher_limit as usize));
        Self { status, topology, commands, is_deleted, watcher_slots, watcher_limit, ended }
    }

    pub(crate) fn id(&self) -> &str {
        &self.status.properties.id
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
    pub(crate) fn step(&self) -> u64 {
        self.status.progress().step
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

    /// Sends a command and waits for the session's description after it.
    ///
    /// # Errors
    /// If the command is refused or the session is deleted meanwhile.
    pub(crate) async fn command(
        &self,
        make: impl FnOnce(Answer) -> Command,
    ) -> Result<v1::Session, ServiceError> {
        let answer = self.ask(make).await??;
        Ok(self.with_watchers(answer))
    }

    /// Sends a command and waits for its answer.
    ///
    /// # Errors
    /// If as many commands wait as are allowed, or the session is deleted meanwhile.
    pub(crate) async fn ask<T>(
        &self,
        make: impl FnOnce(oneshot::Sender<T>) -> Command,
    ) -> Result<T, ServiceError> {
        let (reply, answer) = oneshot::channel();
        self.commands.try_send(make(reply)).map_err(|error| match error {
            TrySendError::Full(_) => self.too_many_commands(),
            TrySendError::Disconnected(_) => ServiceError::session_deleted(self.id()),
        })?;
        answer.await.map_err(|_gone| ServiceError::session_deleted(self.id()))
    }

    /// Asks that frames hold these fields while the wish lasts, the newest one too if its state still stands.
    ///
    /// # Errors
    /// If as many commands wait as are allowed, or the session is deleted meanwhile.
    pub(crate) async fn provide(&self, fields: FieldSet) -> Result<Wish, ServiceError> {
        let (wish, is_new) = self.feed().wish(fields);
        if is_new || !self.feed().newest().frame.fields().covers(fields) {
            self.ask(Command::CompleteNewest).await?;
        }
        Ok(wish)
    }

    /// Tells the thread to end, after the step in progress.
    pub(crate) fn end(&self) {
        self.is_deleted.store(true, Ordering::Relaxed);
        // Wakes the thread if it waits for a command. If it is gone, it has ended already; if the queue is full,
        // it is awake.
        let _ = self.commands.try_send(Command::End);
    }

    /// Waits until the thread has ended and its memory is free.
    pub(crate) async fn ended(&self) {
        self.ended.cancelled().await;
    }

    /// Makes the next step panic, as a bug would: for tests of isolation.
    #[doc(hidden)]
    pub(crate) fn inject_panic(&self) {
        let _ = self.commands.try_send(Command::InjectPanic);
    }

    fn too_many_commands(&self) -> ServiceError {
        let (id, allowed) = (self.id(), MAX_COMMANDS);
        let message = format!(
            "{allowed} commands wait for the next step of session '{id}'; allowed: at most {allowed}"
        );
        ServiceError::new(Reason::TooManyCommands, message).with("session_id", id).with("allowed", allowed)
    }

    fn with_watchers(&self, mut session: v1::Session) -> v1::Session {
        session.watcher_count = self.watcher_limit - self.watcher_slots.available_permits() as u32;
        session
    }
}
