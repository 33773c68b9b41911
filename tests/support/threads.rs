//! Thread pools of chosen sizes.

/// Thread counts over which results must not change.
pub const THREAD_COUNTS: [usize; 4] = [1, 2, 3, 8];

/// A pool of `count` threads.
pub fn pool(count: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("a pool of threads")
}

/// Runs `work` on a pool of `count` threads of its own.
pub fn with_threads<T: Send>(count: usize, work: impl FnOnce() -> T + Send) -> T {
    pool(count).install(work)
}
