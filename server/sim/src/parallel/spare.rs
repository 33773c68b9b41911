//! What a call needs while it runs, kept for the next one.

use std::{
    ops::{Deref, DerefMut},
    sync::{Mutex, PoisonError},
};

/// Keeps values between calls: as many as calls have run at the same time.
#[derive(Debug, Default)]
pub(crate) struct Spare<T>(Mutex<Vec<T>>);

/// A value that goes back by itself.
pub(crate) struct Lent<'a, T: Default> {
    spare: &'a Spare<T>,
    value: T,
}

impl<T: Default> Spare<T> {
    /// Keeps `count` values or more, so that as many calls at the same time make none; each is prepared.
    pub(crate) fn ready(&mut self, count: usize, prepare: impl Fn(&mut T)) {
        let values = self.0.get_mut().unwrap_or_else(PoisonError::into_inner);
        let count = count.max(values.len());
        values.resize_with(count, T::default);
        values.iter_mut().for_each(prepare);
    }

    /// What a call before has left, or a new value; to be put back.
    pub(crate) fn take(&self) -> T {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default()
    }

    /// Keeps it for the next call.
    pub(crate) fn put(&self, value: T) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(value);
    }

    /// The same as [`Self::take`], of a value that is put back when it is dropped.
    pub(crate) fn lend(&self) -> Lent<'_, T> {
        Lent { spare: self, value: self.take() }
    }
}

impl<T: Default> Deref for Lent<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T: Default> DerefMut for Lent<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}

impl<T: Default> Drop for Lent<'_, T> {
    fn drop(&mut self) {
        self.spare.put(std::mem::take(&mut self.value));
    }
}
