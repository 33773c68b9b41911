//! What the command says: results, errors with their exit codes, sessions and diagnostics in words.
//!
//! Enters: values. Leaves: lines on standard output and standard error. Modules in reading order:

pub(crate) mod error;
pub(crate) mod output;
pub(crate) mod version;
pub(crate) mod diagnostics;
pub(crate) mod session;
