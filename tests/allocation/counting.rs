//! The allocator of this program, which counts.
#![allow(unsafe_code, reason = "an allocator that counts hands every request on to the system's")]

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    sync::atomic::{AtomicU64, Ordering},
};

use rayon::prelude::*;

struct Counting;

thread_local! {
    /// Whether what this thread allocates counts.
    static IS_COUNTED: Cell<bool> = const { Cell::new(true) };
}

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

// SAFETY: every call goes to the system's allocator with the arguments that it came with.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(u64::from(IS_COUNTED.get()), Ordering::Relaxed);

        // SAFETY: the caller keeps `alloc`'s contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps `dealloc`'s contract.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.fetch_add(u64::from(IS_COUNTED.get()), Ordering::Relaxed);

        // SAFETY: the caller keeps `realloc`'s contract.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Allocations since the program began.
pub(crate) fn allocations() -> u64 {
    ALLOCATIONS.load(Ordering::Relaxed)
}

/// Makes a call whose allocations do not count.
pub(crate) fn uncounted<T>(call: impl FnOnce() -> T) -> T {
    IS_COUNTED.set(false);
    let result = call();
    IS_COUNTED.set(true);
    result
}

/// Lets every worker of the pool take work from another: the first time, rayon's deques register
/// the thread, which allocates once per thread, whatever the work.
pub(crate) fn warm_up(threads: usize) {
    let seen = AtomicU64::new(0);
    let wanted = (1_u64 << threads) - 1;
    while seen.load(Ordering::Relaxed) != wanted {
        (0..256).into_par_iter().for_each(|_| {
            let worker = rayon::current_thread_index().expect("work runs on the pool");
            seen.fetch_or(1 << worker, Ordering::Relaxed);
            (0..1000).for_each(|_| std::hint::spin_loop());
        });
    }
}
