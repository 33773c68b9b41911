//! Particles of other ranks that come, sorted by block.

/// A particle of another rank: the key of its new block, its cell there and its place.
pub(super) type Arrival = (u64, u16, u32);

/// Those that arrive in a block.
pub(super) fn arrivals_of(arrivals: &[Arrival], key: u64) -> &[Arrival] {
    if arrivals.is_empty() {
        return &[];
    }
    let from = arrivals.partition_point(|arrival| arrival.0 < key);
    let count = arrivals[from..].partition_point(|arrival| arrival.0 == key);
    &arrivals[from..from + count]
}
