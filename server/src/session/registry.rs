//! Which sessions there are: ids to handles, and how many there may be.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use uuid::Uuid;

use super::{
    handle::Session,
    place::{Place, Places},
};
use crate::error::{Reason, ServiceError};

/// The sessions of a server.
#[derive(Debug)]
pub(crate) struct Registry {
    /// By id; `None` stands for a session that is being made.
    sessions: Mutex<BTreeMap<String, Option<Arc<Session>>>>,
    places: Places,
}

/// An id that no other session can take; free again if the reservation is dropped without a session.
#[derive(Debug)]
pub(crate) struct Reservation {
    registry: Arc<Registry>,
    id: String,
}

impl Registry {
    /// An empty registry of at most `limit` sessions.
    pub(crate) fn new(limit: u32) -> Self {
        Self { sessions: Mutex::new(BTreeMap::new()), places: Places::new(limit) }
    }

    /// Room for one more session.
    ///
    /// # Errors
    /// If there are as many as are allowed.
    pub(crate) fn place(&self) -> Result<Place, ServiceError> {
        self.places.take()
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
        find(&self.lock(), id)
    }

    /// Whether there is the session of a uid.
    pub(crate) fn has(&self, uid: &str) -> bool {
        self.lock().values().flatten().any(|session| session.uid() == uid)
    }

    /// The error of a session that there is not.
    pub(crate) fn missing(id: &str) -> ServiceError {
        not_found(id)
    }

    /// Takes a session out of the registry, if it has this uid; an empty one fits every session.
    ///
    /// # Errors
    /// If there is none of this id, or it has another uid.
    pub(crate) fn remove(&self, id: &str, uid: &str) -> Result<Arc<Session>, ServiceError> {
        let mut sessions = self.lock();
        let session = find(&sessions, id)?;
        session.expect_uid(uid)?;
        sessions.remove(id);
        Ok(session)
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

    /// All sessions that there are.
    pub(crate) fn all(&self) -> Vec<Arc<Session>> {
        self.lock().values().flatten().cloned().collect()
    }

    /// Pauses the sessions of some uids, as far as they are there.
    pub(crate) fn pause(&self, uids: &[String]) {
        for session in self.all().iter().filter(|session| uids.iter().any(|uid| uid == session.uid())) {
            // One that has ended needs no pause.
            let _ended = session.control.pause(None);
        }
    }

    /// Deletes the sessions that nobody has used for as long as they are kept.
    pub(crate) fn end_unused(&self) {
        let mut sessions = self.lock();
        let is_over = |session: &Arc<Session>| session.lease_left() == Some(Duration::ZERO);
        let unused: Vec<_> =
            sessions.extract_if(.., |_, session| session.as_ref().is_some_and(is_over)).collect();
        drop(sessions);
        for (id, session) in unused {
            tracing::info!(session = id, "deleted, since nobody used it");
            if let Some(session) = session {
                session.end();
            }
        }
    }

    /// Ends all sessions and waits for their threads, for at most `patience`: a thread ends after
    /// the step in progress, however long that takes. A step of a session that is kept has half of the time.
    pub(crate) async fn end_all(&self, patience: Duration) {
        let sessions: Vec<_> = std::mem::take(&mut *self.lock()).into_values().flatten().collect();
        for session in &sessions {
            let what = if session.is_kept() { "left" } else { "deleted" };
            tracing::info!(session = session.id(), "{what}, since the server ends");
            session.leave();
        }
        let half = patience / 2;
        if tokio::time::timeout(half, self.places.emptied()).await.is_ok() {
            return;
        }
        for session in &sessions {
            session.hurry();
        }
        if tokio::time::timeout(half, self.places.emptied()).await.is_err() {
            tracing::warn!("some sessions are still in a step and are not waited for");
        }
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Option<Arc<Session>>>> {
        // No code that holds the lock can leave the map half changed.
        self.sessions.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Reservation {
    pub(crate) fn id(&self) -> &str {
        &self.id
    }

    /// Gives the id to the session, unless the server ended all sessions meanwhile.
    pub(crate) fn fill(self, session: Arc<Session>) {
        if let Some(entry) = self.registry.lock().get_mut(&self.id) {
            *entry = Some(session);
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

/// A session that is being made is none yet: no client knows it.
fn find(sessions: &BTreeMap<String, Option<Arc<Session>>>, id: &str) -> Result<Arc<Session>, ServiceError> {
    sessions.get(id).cloned().flatten().ok_or_else(|| not_found(id))
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
