//! `cargo xtask wheel | tarball`: nappe as one file, for machines without Rust.
//!
//! Enters what cargo builds; leaves files in the folder `dist` of the target folder. `cargo xtask prove builds` installs
//! and uses them.

mod programs;
mod notices;
pub(crate) mod tarball;
pub(crate) mod wheel;
pub(crate) mod proof;
