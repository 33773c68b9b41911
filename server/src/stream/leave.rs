//! Why a watcher ends: its reader is gone, its session or the server ends, or it is cut.
//!
//! Enters: what the watcher's task met with. Leaves: what its stream breaks with, if it does. The log is told of what concerns
//! this watcher alone; how sessions and the server end stands there anyway.

use std::time::Duration;

use crate::{
    error::{Reason, ServiceError},
    refusals::Call,
};

/// Why a watcher's task ends.
pub(super) enum Leave {
    /// The reader is gone, or the session finished.
    Quietly,
    /// The stream breaks, as all those of its session or of the server do.
    WithOthers(ServiceError),
    /// The stream breaks alone.
    With(ServiceError),
}

impl Leave {
    /// What the stream of a call breaks with, if it does.
    pub(super) fn error(self, call: &Call) -> Option<ServiceError> {
        match self {
            Self::Quietly => None,
            Self::WithOthers(error) => Some(error),
            Self::With(error) => {
                call.refused(error.reason);
                Some(error)
            }
        }
    }

    /// Frame `next` is no longer kept.
    pub(super) fn too_slow(next: u64, oldest: u64) -> Self {
        let message = format!("frame {next} was due, but the oldest that the session keeps is {oldest}");
        let error = ServiceError::new(Reason::WatcherTooSlow, message);
        Self::With(error.with("next_frame", next).with("oldest_frame", oldest))
    }

    /// A message waited for so long.
    pub(super) fn stalled(stall: Duration) -> Self {
        let seconds = stall.as_secs_f64();
        let message = format!("the watcher fetched nothing for {seconds} s while a message waited");
        Self::With(ServiceError::new(Reason::WatcherStalled, message).with("seconds", seconds))
    }

    /// Watchers hold more than the bytes that are allowed.
    pub(super) fn gave_way(allowed: u64) -> Self {
        let message = format!(
            "watchers that do not read hold more than {allowed} bytes of frames, and this one has waited longest"
        );
        Self::With(ServiceError::new(Reason::WatcherStalled, message).with("allowed", allowed))
    }
}
