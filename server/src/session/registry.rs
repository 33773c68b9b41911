//! Which sessions there are: ids to handles, and places for them.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use uuid::Uuid;

use super::handle::Session;
use crate::error::{Reason, ServiceError};

/// The sessions of a server. `None` stands for one that is being made.
#[derive(Debug)]
pub(crate) struct Registry {
    sessions: Mutex<BTreeMap<String, Option<Arc<Session>>>>,
    slots: Arc<Semaphore>,
    limit: u32,
}

/// An id that nobody else can take; given back unless a session is put in its place.
#[derive(Debug)]
pub(crate) struct Reservation {
    registry: Arc<Registry>,
    id: String,
}

impl Registry {
    /// No sessions, and at most `limit`.
    pub(crate) fn new(limit: u32) -> Self {
        let slots = Arc::new(Semaphore::new(limit as usize));
        Self { sessions: Mutex::new(BTreeMap::new()), slots, limit }
    }

    /// A place for one more session; its thread holds it until it ends.
    ///
    /// # Errors
    /// If there are as many as are allowed.
    pub(crate) fn slot(&self) -> Result<OwnedSemaphorePermit, ServiceError> {
        Arc::clone(&self.slots).try_acquire_owned().map_err(|_full| {
            let allowed = self.limit;
            let message = format!("the server has {allowed} sessions; allowed: at most {allowed}");
            ServiceError::new(Reason::TooManySessions, message).with("allowed", allowed)
        })
    }

    /// Reserves an id, or a new one if it is empty.
    ///
    /// # Errors
    /// If another session has it.
    pub(crate) fn reserve(self: &Arc<Self>, id: &str) -> Result<Reservation, ServiceError> {
        let mut sessions = self.lock();
        let id = if id.is_empty() { new_id(&sessions) } else { id.to_owned() };
        if sessions.contains_key(&id) {
            let message = format!("another session has the id '{id}'");
            return Err(ServiceError::new(Reason::SessionExists, message).with("session_id", id));
        }
        sessions.insert(id.clone(), None);
        drop(sessions);
        Ok(Reservation { registry: Arc::clone(self), id })
    }

    /// The session of an id.
    ///
    /// # Errors
    /// If there is none.
    pub(crate) fn get(&self, id: &str) -> Result<Arc<Session>, ServiceError> {
        self.lock().get(id).cloned().flatten().ok_or_else(|| not_found(id))
    }

    /// Takes a session out.
    ///
    /// # Errors
    /// If there is none of this id.
    pub(crate) fn remove(&self, id: &str) -> Result<Arc<Session>, ServiceError> {
        let mut sessions = self.lock();
        match sessions.remove(id) {
            Some(Some(session)) => Ok(session),
            Some(None) => {
                // It is being made: it stays reserved, and nobody knows it yet.
                sessions.insert(id.to_owned(), None);
                Err(not_found(id))
            }
            None => Err(not_found(id)),
        }
    }

    /// Up to `count` sessions with ids after `after`, and whether more follow.
    pub(crate) fn page(&self, after: &str, count: usize) -> (Vec<Arc<Session>>, bool) {
        let sessions = self.lock();
        let bounds = (std::ops::Bound::Excluded(after.to_owned()), std::ops::Bound::Unbounded);
        let mut page: Vec<_> =
            sessions.range(bounds).filter_map(|(_, session)| session.clone()).take(count + 1).collect();
        let more = page.len() > count;
        page.truncate(count);
        (page, more)
    }

    /// Ends all sessions and waits for their threads, for at most `patience`: a thread ends after
    /// the step in progress, however long that takes.
    pub(crate) async fn end_all(&self, patience: Duration) {
        for session in std::mem::take(&mut *self.lock()).into_values().flatten() {
            session.end();
        }
        if tokio::time::timeout(patience, self.slots.acquire_many(self.limit)).await.is_err() {
            tracing::warn!("sessions are still in a step; they are left behind");
        }
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Option<Arc<Session>>>> {
        // No code that holds the lock can leave the map half changed.
        self.sessions.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Reservation {
    /// The reserved id.
    pub(crate) fn id(&self) -> &str {
        &self.id
    }

    /// Puts the session in its place, unless the server took all places away meanwhile.
    pub(crate) fn fill(self, session: Arc<Session>) {
        if let Some(place) = self.registry.lock().get_mut(&self.id) {
            *place = Some(session);
        }
    }
}

impl Drop for Reservation {
    fn drop(&mut self) {
        let mut sessions = self.registry.lock();
        if matches!(sessions.get(&self.id), Some(None)) {
            sessions.remove(&self.id);
        }
    }
}

fn new_id(taken: &BTreeMap<String, Option<Arc<Session>>>) -> String {
    loop {
        let id = format!("session-{}", &Uuid::new_v4().simple().to_string()[..8]);
        if !taken.contains_key(&id) {
            return id;
        }
    }
}

fn not_found(id: &str) -> ServiceError {
    ServiceError::new(Reason::SessionNotFound, format!("no session has the id '{id}'")).with("session_id", id)
}
