//! Which bits this version computes: versions with the same number go on with each other's states as they would themselves.

/// XXH3 (64 bits) of `tests/golden/hashes.txt`, which has the hash of every committed run. A test compares them, and
/// `cargo xtask bless hashes` writes this number.
pub const BITS: u64 = 0x50da_5176_ce4a_5c00;
