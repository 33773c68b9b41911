//! A hash of many particles without an order: the wrapping sum of one XXH3 per particle, seeded with its number. So
//! threads, ranks and particles that were sorted come to the same, and nothing is copied.

use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// Particles that a thread takes at a time.
const BLOCK_SIZE: usize = 4096;

/// XXH3 of numbers as little-endian binary64.
#[inline]
pub(crate) fn hash_numbers<const N: usize>(seed: u64, numbers: [f64; N]) -> u64 {
    xxh3_64_with_seed(numbers.map(f64::to_le_bytes).as_flattened(), seed)
}

/// Wrapping sum of `hash(place, item)` over all items, by all threads.
#[allow(clippy::disallowed_methods, reason = "a sum modulo 2^64 is the same in every order")]
pub(crate) fn sum_hashes<T: Sync>(items: &[T], hash: impl Fn(usize, &T) -> u64 + Sync) -> u64 {
    let of_block = |(block, items): (usize, &[T])| {
        let places = block * BLOCK_SIZE..;
        places.zip(items).map(|(place, item)| hash(place, item)).fold(0, u64::wrapping_add)
    };
    items.par_chunks(BLOCK_SIZE).enumerate().map(of_block).reduce(|| 0, u64::wrapping_add)
}
