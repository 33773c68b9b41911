//! Which pieces of a cloth lie still. A piece is what springs and elements hold together.
//!
//! Enters: positions after each step of the scene, and the error that the scene allows. Leaves: how much is calm. No step depends
//! on it. Modules in reading order:

mod least;
mod ladder;
mod watch;

pub(crate) use least::check_rest;
pub(crate) use watch::Watch;
