//! What the machine's memory does meanwhile: a triad, a = b + s c, over arrays that no cache holds.

use std::time::Instant;

use nappe_sim::parallel::triad;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::sample;
use crate::words::{
    error::{CliError, Result},
    output,
};

/// Numbers in each of the three arrays: 128 MB each.
const LENGTH: usize = 1 << 24;
/// Bytes moved per number: two are read, one is written, for which its line is read first.
const BYTES: usize = 4 * size_of::<f64>();
/// Times that it is run; the fastest counts.
const REPETITIONS: usize = 5;

/// Bytes per second of a triad on each of the thread counts.
///
/// # Errors
/// When threads cannot be started.
pub(crate) fn bandwidths(threads: &[usize]) -> Result<Vec<f64>> {
    let mut triad = Triad::new();
    let mut bandwidth = |count: &usize| {
        let pool = ThreadPoolBuilder::new().num_threads(*count).build();
        let pool = pool.map_err(|error| {
            let threads = output::several(*count as u64, "thread");
            CliError::failure(format!("cannot start {threads}: {error}"))
        })?;
        Ok(triad.bandwidth(&pool))
    };
    threads.iter().map(&mut bandwidth).collect()
}

/// Arrays for a triad.
struct Triad {
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
}

impl Triad {
    fn new() -> Self {
        Self { a: vec![0.5; LENGTH], b: vec![1.0; LENGTH], c: vec![2.0; LENGTH] }
    }

    /// Bytes per second on the threads of a pool, write-allocates included.
    fn bandwidth(&mut self, pool: &ThreadPool) -> f64 {
        let Self { a, b, c } = self;
        let mut run = || {
            let begin = Instant::now();
            pool.install(|| triad(a, b, 3.0, c));
            begin.elapsed().as_secs_f64()
        };
        (LENGTH * BYTES) as f64 / sample::minimum((0..REPETITIONS).map(|_| run()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_moves_more_than_nothing_and_less_than_a_cache() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        let found = Triad::new().bandwidth(&pool);
        // How fast is for the benchmark to say: a machine that is busy is slow.
        assert!(found > 0.0 && found < 1e12, "{found} bytes per second");
    }
}
