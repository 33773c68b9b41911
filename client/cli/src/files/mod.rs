//! Files of the command line: what a path means, and how a file is written whole or not at all.
//!
//! Enters: paths and bytes. Leaves: files, and notes in saved frames. Modules in reading order:

pub(crate) mod write;
pub(crate) mod aside;
pub(crate) mod paths;
pub(crate) mod frame_notes;
