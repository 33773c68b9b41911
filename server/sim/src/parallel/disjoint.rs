//! A field whose elements are written by several threads, each element by one of them.
#![allow(unsafe_code, reason = "what the borrow checker cannot see: places that do not repeat")]

use std::{marker::PhantomData, ops::Range};

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

    /// How many elements it has.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Asks for the element at a place to be brought near: it will be needed soon.
    #[inline(always)]
    pub(crate) fn prefetch(&self, place: usize) {
        #[cfg(target_arch = "x86_64")]
        if place < self.len {
            use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};

            // SAFETY: within the field; every x86-64 has the instruction, which changes no memory.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(self.start.add(place).cast()) };
        }

        #[cfg(not(target_arch = "x86_64"))]
        let _ = place;
    }

    /// Stops the program where a place is outside of the field.
    ///
    /// # Panics
    /// In that case.
    #[inline(always)]
    pub(crate) fn hold_all<const N: usize>(&self, places: &[u32; N]) {
        let mut last = 0;
        for place in places {
            last = last.max(*place);
        }

        assert!((last as usize) < self.len);
    }

    /// The element at a place, which [`Self::hold_all`] has let pass.
    ///
    /// # Safety
    /// The place is within the field, and nobody else reaches it while the reference lives.
    #[inline(always)]
    #[allow(clippy::mut_from_ref, reason = "the caller keeps places apart")]
    pub(crate) unsafe fn held_slot(&self, place: usize) -> &mut T {
        debug_assert!(place < self.len);
        // SAFETY: the caller promises a place within the field, which is borrowed, with nobody else there.
        unsafe { &mut *self.start.add(place) }
    }

    /// A range of elements.
    ///
    /// # Safety
    /// Nobody else reaches any of them while the reference lives.
    ///
    /// # Panics
    /// When the range is not within the field.
    pub(crate) unsafe fn range(&self, range: Range<usize>) -> &'a mut [T] {
        assert!(range.start <= range.end && range.end <= self.len);
        // SAFETY: within the field, which is borrowed; the caller promises that nobody else is there.
        unsafe { std::slice::from_raw_parts_mut(self.start.add(range.start), range.len()) }
    }

    /// The element at a place.
    ///
    /// # Safety
    /// Nobody else reaches this place while the reference lives.
    ///
    /// # Panics
    /// When the place is outside of the field.
    #[inline(always)]
    pub(crate) unsafe fn slot(&self, place: usize) -> &'a mut T {
        assert!(place < self.len);
        // SAFETY: within the field, which is borrowed; the caller promises that nobody else is there.
        unsafe { &mut *self.start.add(place) }
    }
}
