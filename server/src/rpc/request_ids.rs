//! Ids of requests to create a session: the same request id gives the same session.
//!
//! An id is remembered as long as its session exists.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError, Weak},
};

use nappe_proto::v1;
use tokio::sync::{Mutex as AsyncMutex, OwnedMutexGuard};
use uuid::Uuid;

use crate::session::Session;

/// What the first request with an id made.
#[derive(Clone, Debug)]
pub(crate) struct CreatedSession {
    pub request: v1::CreateSessionRequest,
    /// The session; the registry owns it.
    pub session: Weak<Session>,
    /// Warnings about its scene.
    pub warnings: Vec<String>,
}

type Entry = Arc<AsyncMutex<Option<CreatedSession>>>;

/// Request ids and what they made.
#[derive(Debug, Default)]
pub(crate) struct RequestIds {
    entries: Mutex<HashMap<Uuid, Entry>>,
}

impl RequestIds {
    /// The entry of an id, locked: a second request with the same id waits here for the first.
    pub(crate) async fn entry(&self, id: Uuid) -> OwnedMutexGuard<Option<CreatedSession>> {
        let entry = {
            let mut entries = self.entries.lock().unwrap_or_else(PoisonError::into_inner);
            entries.retain(|_, entry| is_needed(entry));
            Arc::clone(entries.entry(id).or_default())
        };
        entry.lock_owned().await
    }
}

/// Whether a request is in progress, or its session still exists.
fn is_needed(entry: &Entry) -> bool {
    if Arc::strong_count(entry) > 1 {
        return true;
    }
    let made = entry.try_lock();
    made.is_ok_and(|made| made.as_ref().is_some_and(|made| made.session.strong_count() > 0))
}
