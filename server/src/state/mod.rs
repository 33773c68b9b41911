//! A session as a file: what another server needs to go on with it, with the same bits.
//!
//! Enters: what a session is. Leaves: bytes; or of bytes, of which nobody may know who wrote them, a simulation that was
//! checked and goes on, or which section is wrong.

mod format;
mod write;
mod read;
mod check;
#[cfg(test)]
mod tests;

pub use check::restore;
pub use format::{FORMAT, FileError, Opened, Section};
pub use read::read;
pub use write::{
    PendingGroup, SavedSession, Waiting, bytes_of_setup, bytes_to_write, setup_section, write, write_with,
};
