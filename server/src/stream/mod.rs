//! What watchers receive: fields of particles, nodes of the grid, frames, topology and diagnostics,
//! and their way from the stepper to each watcher.

mod packing;
mod grid_frame;
mod fields;
mod frame;
pub(crate) mod wire;
pub(crate) mod topology;
mod feed;
mod watcher;

pub(crate) use feed::{Ending, Feed, Lookup};
pub(crate) use fields::{Array, Contents, Wanted};
pub(crate) use frame::{EncodedFrame, FrameHead};
pub(crate) use grid_frame::{GridChoice, Selection};
pub(crate) use packing::NotFinite;
pub(crate) use watcher::{Delivery, Figures, Frames, WatchStream, draining_error, watch};
