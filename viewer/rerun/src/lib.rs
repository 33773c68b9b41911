//! Frames to Rerun: meshes, snow, pins, colliders, forces on them, the snow's grid, time series, a layout.
//!
//! Enters: topology and frames of the client library. Leaves: a recording file (.rrd) or a Rerun viewer that
//! shows them. The only crate that names the Rerun SDK. Colour, camera, mesh normals: all that belongs to the
//! eye is decided here, nothing of it on the server.
//!
//! [`show`] does everything for a session on a server; [`Recorder`] records what it is given, blocking while
//! the SDK does; [`LiveRecorder`] never blocks its caller and drops frames instead.

mod sdk;
mod error;
mod lock;
mod full;
mod geometry;
mod spacing;
mod coloring;
mod plots;
mod snow_plots;
mod body;
mod loads;
mod grid;
mod ground;
mod facets;
mod extent;
mod outline;
mod collider;
mod arrows;
mod particle_arrows;
mod camera;
mod layout;
mod recorder;
mod live;
mod show;

pub use coloring::{ColorBy, ParseColorError};
pub use error::{INSTALL_HINT, RerunError};
pub use live::{LiveRecorder, LiveSummary};
pub use recorder::{Recorder, Sink};
pub use show::{ShowError, ShowOptions, Shown, show};
