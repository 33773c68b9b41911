//! The places of a server's sessions: how many threads of sessions there may be.
//!
//! A create that is given up still has memory to return to the system, which takes a second at gigabytes. Its thread
//! then takes a place among those that leave, and the place of its session is free at once. Where as many leave as
//! there may be sessions, it keeps its place until it has ended: there are never more threads than twice the limit.

use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::error::{Reason, ServiceError};

/// The places of a server.
#[derive(Debug)]
pub(super) struct Places {
    sessions: Arc<Semaphore>,
    leaving: Arc<Semaphore>,
    limit: u32,
}

/// The place of one session, which its thread holds until it ends.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    permit: Arc<Mutex<OwnedSemaphorePermit>>,
    leaving: Arc<Semaphore>,
}

impl Places {
    /// Places for `limit` sessions.
    pub(super) fn new(limit: u32) -> Self {
        let [sessions, leaving] = [(); 2].map(|()| Arc::new(Semaphore::new(limit as usize)));
        Self { sessions, leaving, limit }
    }

    /// A place for one more session.
    ///
    /// # Errors
    /// If there are as many as are allowed.
    pub(super) fn take(&self) -> Result<Place, ServiceError> {
        let permit = Arc::clone(&self.sessions).try_acquire_owned().map_err(|_full| {
            let allowed = self.limit;
            let message = format!("the server has {allowed} sessions; allowed: at most {allowed}");
            ServiceError::new(Reason::TooManySessions, message).with("allowed", allowed)
        })?;
        Ok(Place { permit: Arc::new(Mutex::new(permit)), leaving: Arc::clone(&self.leaving) })
    }

    /// Waits until no thread has a place.
    pub(super) async fn emptied(&self) {
        // In the order in which a thread may have both; neither is ever closed.
        for places in [&self.sessions, &self.leaving] {
            drop(places.acquire_many(self.limit).await);
        }
    }
}

impl Place {
    /// Frees the place for another session, if its thread can have one among those that leave.
    pub(super) fn leave(&self) {
        if let Ok(leaving) = Arc::clone(&self.leaving).try_acquire_owned() {
            *self.permit.lock().unwrap_or_else(PoisonError::into_inner) = leaving;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn who_leaves_frees_the_place_as_long_as_few_leave() {
        let places = Places::new(1);
        let first = places.take().expect("a place");
        assert_eq!(places.take().expect_err("full").reason, Reason::TooManySessions);

        first.leave();
        let second = places.take().expect("the place of the first");
        // The first has not ended: the second must.
        second.leave();
        assert!(places.take().is_err());
        drop(first);
        second.leave();
        drop(places.take().expect("the place of the second"));

        let ended = tokio::time::timeout(std::time::Duration::from_millis(20), places.emptied());
        assert!(ended.await.is_err(), "the second leaves, and is waited for");
    }
}
