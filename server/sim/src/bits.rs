//! Which bits this version computes: versions with the same number go on with each other's states as they would themselves.

/// XXH3 (64 bits) of `tests/golden/hashes.txt`, which has the hash of every committed run. A test compares them, and
/// `cargo xtask bless hashes` writes this number.
pub const BITS: u64 = 0xfb62_a5ee_a472_545f;
