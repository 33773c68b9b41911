//! What watchers receive: topology, fields of particles, nodes of the grid, diagnostics, and how
//! frames travel from the stepper to each watcher.
//!
//! Enters: a simulation between two steps. Leaves: messages of at most 1 MiB.

mod pieces;
mod memory;
mod arrays;
mod packing;
mod grid_frame;
mod fields;
mod demand;
mod diagnostics;
mod collider;
mod topology_pieces;
mod topology;
mod frame;
mod history;
mod streams;
mod changes;
mod feed;
mod stream_kind;
mod slot;
mod transit;
mod delivery;
mod watch_stream;
mod leave;
mod watcher;
mod frame_body;

pub(crate) use arrays::Arrays;
pub(crate) use collider::pose;
pub(crate) use delivery::{Delivery, Pace};
pub(crate) use demand::Wish;
pub(crate) use diagnostics::{diagnostics, initial_diagnostics, rejected};
pub(crate) use feed::{Ending, Feed};
pub(crate) use fields::{EncodedField, FieldSet, Wanted};
pub(crate) use frame::{EncodedFrame, FrameHead};
pub(crate) use frame_body::{answer, with_frames};
pub(crate) use grid_frame::{GridChoice, Selection};
pub(crate) use packing::NotFinite;
pub(crate) use stream_kind::{DiagnosticsOnly, Frames};
pub(crate) use streams::Streams;
pub(crate) use topology::topology;
pub(crate) use transit::Cut;
pub(crate) use watch_stream::{Seat, WatchStream};
pub(crate) use watcher::watch;
