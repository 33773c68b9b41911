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
    /// The pool of a test, whose only thread is that of the test itself: nobody has to be woken for a step.
    static OWN: ThreadPool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .use_current_thread()
        .build()
        .expect("a thread that is in no pool yet");
}

/// Runs `work` where it is, on one thread, unless that is in a pool already.
///
/// Tests run side by side on all cores, and results have the same bits for any number of threads: more
/// threads for each would only wait for each other.
pub fn on_one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    if rayon::current_thread_index().is_none() {
        OWN.with(|_| ());
    }
    work()
}
