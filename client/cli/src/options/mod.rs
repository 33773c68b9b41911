//! Options that several verbs share, and what their values mean.
//!
//! Enters: words of the command line. Leaves: values that were checked. Modules in reading order:

pub(crate) mod fields;
pub(crate) mod picture_args;
pub(crate) mod args;
pub(crate) mod particles;
pub(crate) mod components;
pub(crate) mod collider_args;
pub(crate) mod pull_args;
pub(crate) mod completion;
