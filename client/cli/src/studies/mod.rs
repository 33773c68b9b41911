//! Studies and sweeps: what their verbs compute, say and write.
//!
//! Enters: a scene and what is asked of it. Leaves: tables, documents and pictures. Modules in reading order:

pub(crate) mod study;
pub(crate) mod chart;
pub(crate) mod plan;
pub(crate) mod stability;
pub(crate) mod sweep;
