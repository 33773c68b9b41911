//! What a call needs while it runs, kept for the next one.

use std::sync::{Mutex, PoisonError};

/// Keeps a value between calls. Calls that run at the same time would each have one of their own, of which the last is kept.
#[derive(Debug, Default)]
pub(super) struct Spare<T>(Mutex<T>);

impl<T: Default> Spare<T> {
    /// What the call before has left; to be put back.
    pub(super) fn take(&self) -> T {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Keeps it for the next call.
    pub(super) fn put(&self, value: T) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = value;
    }
}
