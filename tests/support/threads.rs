//! Thread pools of chosen sizes.

use rayon::ThreadPool;

/// Thread counts over which results must not change.
pub const THREAD_COUNTS: [usize; 4] = [1, 2, 3, 8];

/// A pool of `count` threads; 0: one for each core.
pub fn pool(count: usize) -> ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("a pool of threads")
}

/// Runs `work` on a pool of `count` threads of its own.
pub fn with_threads<T: Send>(count: usize, work: impl FnOnce() -> T + Send) -> T {
    pool(count).install(work)
}

thread_local! {
    /// The pool of a test.
    static OWN: ThreadPool = pool(1);
}

/// Runs `work` on one thread that belongs to the calling test, or where it is if that is in a pool already.
///
/// Tests run side by side on all cores, and results have the same bits for any number of threads: more
/// threads for each would only wait for each other.
pub fn on_one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    if rayon::current_thread_index().is_some() { work() } else { OWN.with(|own| own.install(work)) }
}
