//! A session: a simulation that steps on its own thread, and the handle that the service holds.
//!
//! Enters: commands, through a channel that the thread reads only between steps. Leaves: answers,
//! frames, and a description that can be read at any time.

mod transition;
mod pace;
mod stopwatch;
mod command;
mod pending_changes;
mod parameters;
mod status;
mod failure;
mod simulator;
mod stepper;
mod handle;
mod start;
mod registry;

pub(crate) use command::{Command, Steps, When};
pub(crate) use handle::Session;
pub(crate) use registry::Registry;
pub(crate) use start::{SessionOptions, start};
