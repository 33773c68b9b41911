//! The same bits: for any number of threads, in debug and release, on any processor, in any numbering.
//! They are also those of the hashes in `tests/golden/hashes.txt`.
//!
//! `cargo xtask bless hashes` rewrites that file; a change of it needs a reason in the commit's message.

mod scenes;
mod snow;
mod hash;
mod hashes;
mod ranks;
mod coarse_ranks;
mod snow_ranks;
mod snow_ranks_failures;
mod snow_ranks_states;
mod numbering;
mod solids;
mod moving;
mod every_change;
mod pulls;
mod begun;
mod surface;
mod rest;
mod simd;
