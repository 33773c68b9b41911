//! Programs and machines beside this process: servers, browsers, ssh, and the viewer.
//!
//! Enters: addresses and frames. Leaves: connections, and programs that were started. Modules in reading order:

pub(crate) mod remote;
pub(crate) mod web;
pub(crate) mod ssh;
pub(crate) mod viewer;
