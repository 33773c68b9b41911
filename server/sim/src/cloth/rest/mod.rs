//! Which pieces of a cloth lie still, and how a cloth sleeps of which all do. A piece is what springs and elements hold together.
//!
//! Enters: positions after each step of the scene, and the error that the scene allows. Leaves: how much is calm; when what
//! sleeps is stepped, and whether that may be taken. Modules in reading order:

mod least;
mod ladder;
mod sleep;
mod watch;
mod asleep;

pub(crate) use asleep::Long;
pub(crate) use least::check_rest;
pub(crate) use watch::Watch;
