//! A session: a simulation that steps on its own thread, and the handle that the service holds.
//!
//! Enters: calls, which take effect at once and are carried out between steps. Leaves: answers, frames, and a
//! description that can be read at any time.

mod transition;
mod pace;
mod lease;
mod pending_changes;
mod parameters;
mod notices;
mod status;
mod failure;
mod taken;
mod keep;
mod waiting;
mod desk;
mod control;
mod changing;
mod kept;
mod keeper;
mod trial;
mod schedule;
mod remains;
mod launcher;
mod ranks;
mod simulator;
mod stepper;
mod handed;
mod keeping;
mod frame_room;
mod handle;
mod place;
mod saved_frame;
mod options;
mod stand;
mod start;
mod stay;
mod revive;
mod save;
mod registry;

pub(crate) use control::Steps;
pub(crate) use handle::Session;
pub(crate) use options::SessionOptions;
pub(crate) use pending_changes::{Accepted, PendingChange};
pub(crate) use ranks::RankCounts;
pub(crate) use registry::Registry;
pub(crate) use revive::{RevivedOptions, revive};
pub(crate) use save::SavedFile;
pub(crate) use saved_frame::SavedFrame;
pub(crate) use stand::Resources;
pub(crate) use start::{fork, start};
pub(crate) use stay::Keeping;
