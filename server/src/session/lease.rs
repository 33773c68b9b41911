//! How long a session that nobody uses is kept.
//!
//! Enters: whether a session is in use, and the time. Leaves: how long it still has.

use std::{
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};

/// When a session was used last: called, watched or stepping.
#[derive(Debug)]
pub(super) struct Lease {
    /// None: a session is kept until it is deleted.
    duration: Option<Duration>,
    used: Mutex<Instant>,
}

impl Lease {
    /// A lease that begins now.
    pub(super) fn new(duration: Option<Duration>) -> Self {
        Self { duration, used: Mutex::new(Instant::now()) }
    }

    /// Somebody uses the session at `now`.
    pub(super) fn renew(&self, now: Instant) {
        *self.used.lock().unwrap_or_else(PoisonError::into_inner) = now;
    }

    /// What is left of it at `now`: zero once it is over; none without one.
    pub(super) fn left(&self, now: Instant) -> Option<Duration> {
        let used = *self.used.lock().unwrap_or_else(PoisonError::into_inner);
        self.duration.map(|duration| duration.saturating_sub(now.saturating_duration_since(used)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lease_runs_from_the_last_use() {
        let (lease, start) = (Lease::new(Some(Duration::from_secs(10))), Instant::now());
        let after = |seconds| start + Duration::from_secs(seconds);
        lease.renew(start);
        assert_eq!(lease.left(after(4)), Some(Duration::from_secs(6)));
        lease.renew(after(4));
        assert_eq!(lease.left(after(13)), Some(Duration::from_secs(1)));
        assert_eq!(lease.left(after(20)), Some(Duration::ZERO));
        assert_eq!(Lease::new(None).left(after(99)), None);
    }
}
