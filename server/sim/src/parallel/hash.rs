//! A hash of many particles without an order: the wrapping sum of one XXH3 per particle, seeded with its number. So
//! threads, ranks and particles that were sorted come to the same, and nothing is copied.

use std::sync::atomic::{AtomicU64, Ordering};

use xxhash_rust::xxh3::xxh3_64_with_seed;

use super::each::{Own, per_row};

/// Particles that a thread takes at a time.
const BLOCK_SIZE: usize = 4096;

/// XXH3 of numbers as little-endian binary64.
#[inline]
pub(crate) fn hash_numbers<const N: usize>(seed: u64, numbers: [f64; N]) -> u64 {
    xxh3_64_with_seed(numbers.map(f64::to_le_bytes).as_flattened(), seed)
}

/// Wrapping sum of `hash(place, item)` over all items, by all threads.
pub(crate) fn sum_hashes<T: Sync>(items: &[T], hash: impl Fn(usize, &T) -> u64 + Sync) -> u64 {
    // Modulo 2^64, which is the same in every order.
    let sum = AtomicU64::new(0);
    Own::whole(items.len(), BLOCK_SIZE).each(per_row(items), |block, items| {
        let places = block * BLOCK_SIZE..;
        let of_block = places.zip(items).map(|(place, item)| hash(place, item)).fold(0, u64::wrapping_add);
        sum.fetch_add(of_block, Ordering::Relaxed);
    });
    sum.into_inner()
}
