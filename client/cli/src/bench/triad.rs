//! What the machine's memory does in the same minutes: a triad, a = b + s c, over arrays that no cache holds.

use std::time::Instant;

use rayon::{ThreadPool, prelude::*};

use super::sample;

/// Numbers in each of the three arrays: 128 MB each.
const LENGTH: usize = 1 << 24;
/// Numbers that a thread takes at a time.
const BLOCK: usize = 1 << 14;
/// Bytes moved per number: two are read, one is written, for which its line is read first.
const BYTES: usize = 4 * size_of::<f64>();
/// Times that it is run; the fastest counts.
const REPETITIONS: usize = 5;

/// Arrays for a triad.
pub(crate) struct Triad {
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
}

impl Triad {
    pub(crate) fn new() -> Self {
        let array = |value: f64| (0..LENGTH).into_par_iter().map(|_| value).collect();
        Self { a: array(0.0), b: array(1.0), c: array(2.0) }
    }

    /// Bytes per second on the threads of a pool, write-allocates included.
    pub(crate) fn bandwidth(&mut self, pool: &ThreadPool) -> f64 {
        let Self { a, b, c } = self;
        let mut run = || {
            let begin = Instant::now();
            pool.install(|| {
                let blocks = (a.par_chunks_mut(BLOCK), b.par_chunks(BLOCK), c.par_chunks(BLOCK));
                blocks.into_par_iter().for_each(|(a, b, c)| {
                    a.iter_mut().zip(b.iter().zip(c)).for_each(|(a, (b, c))| *a = b + 3.0 * c);
                });
            });
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
        assert!((1e8..1e12).contains(&found), "{found} bytes per second");
    }
}
