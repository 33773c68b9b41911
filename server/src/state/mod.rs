//! A session as a file: what another server needs to go on with it, with the same bits.
//!
//! Enters: what a session is. Leaves: bytes; or of bytes, of which nobody may know who wrote them, a simulation that was
//! checked and goes on, or which section is wrong. And the folder of a server, in which such files and logs outlive it.

mod format;
mod write;
mod read;
mod check;
mod journal;
mod files;
mod left;
mod folder;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod folder_tests;

pub use check::restore;
pub(crate) use folder::{SessionFolder, StateFolder};
pub(crate) use format::Digest;
pub use format::{FORMAT, FileError, Opened, Section};
pub(crate) use journal::{Goal, Record, Replay, encode, records};
pub(crate) use left::StatePlace;
pub use left::newest_state;
pub use read::read;
pub(crate) use read::told_session;
pub use write::{
    PendingGroup, SavedSession, Waiting, bytes_of_setup, bytes_to_write, setup_section, write, write_with,
};
pub(crate) use write::{bytes_to_write_without_setup, write_without_setup};
