//! A field whose elements are written by several threads, each element by one of them.
#![allow(unsafe_code, reason = "what the borrow checker cannot see: places that do not repeat")]

use std::marker::PhantomData;

/// A field shared for writing at places that the caller keeps apart.
pub(crate) struct Disjoint<'a, T> {
    start: *mut T,
    len: usize,
    field: PhantomData<&'a mut [T]>,
}

// SAFETY: an element is reached by one thread at a time: the promise of `slot`.
unsafe impl<T: Send> Sync for Disjoint<'_, T> {}

impl<'a, T> Disjoint<'a, T> {
    /// Shares a field for as long as the borrow lasts.
    pub(crate) fn new(field: &'a mut [T]) -> Self {
        Self { start: field.as_mut_ptr(), len: field.len(), field: PhantomData }
    }

    /// The element at a place.
    ///
    /// # Safety
    /// Nobody else reaches this place while the reference lives.
    ///
    /// # Panics
    /// When the place is outside of the field.
    #[inline(always)]
    #[allow(clippy::mut_from_ref, reason = "the caller keeps places apart")]
    pub(crate) unsafe fn slot(&self, place: usize) -> &mut T {
        assert!(place < self.len);
        // SAFETY: within the field, which is borrowed; the caller promises that nobody else is there.
        unsafe { &mut *self.start.add(place) }
    }
}
