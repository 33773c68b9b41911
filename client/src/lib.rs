//! Client library: connects to a server, creates and controls sessions, watches frames.
//!
//! Enters: the address of a server. Leaves: plain owned values ([`Topology`], [`Frame`]), checked for size
//! and finiteness, and errors that carry the server's reason. Read in this order: [`Client`] asks, `options`
//! says what can be asked, [`FrameStream`] receives, `decode` turns pieces of the wire into frames.
//!
//! ```no_run
//! use nappe_client::{Client, CreateSession, Event, WatchOptions};
//!
//! # async fn run() -> Result<(), nappe_client::ClientError> {
//! let client = Client::connect("http://127.0.0.1:6277").await?;
//! let session = client.create_session(CreateSession::named("demo")).await?.session.session_id;
//! let mut frames = client.watch(&session, WatchOptions::default()).await?;
//! client.play(&session, 1.0).await?;
//! while let Some(event) = frames.next().await {
//!     if let Event::Frame(frame) = event? {
//!         println!("t = {:.3} s, {} particles", frame.time, frame.positions.len());
//!     }
//! }
//! # Ok(())
//! # }
//! ```

/// How arrays of frames are made small.
pub use nappe_proto::packed;
/// What a server may ask for, and how it is found.
pub use nappe_proto::token::{self, Token};
/// Why a call can fail, and messages of the service as they are on the wire.
pub use nappe_proto::{Reason, v1};

mod reconnect;
mod selection;
mod options;
mod pose;
mod frame;
mod collider_mesh;
mod collider;
mod topology;
mod join;
mod decode;
mod upload;
mod mesh_file;
mod error;
mod exit;
mod target;
mod client;
mod pending;
mod link;
mod saved;
mod step;
mod resume;
mod watch;
mod watch_diagnostics;

pub use client::{Client, CreatedSession, Paused};
pub use collider::{Collider, Shape, components};
pub use collider_mesh::{mesh_points, mesh_triangles};
pub use decode::{DecodeError, Decoder};
pub use error::{ClientError, ServerError};
pub use exit::Exit;
pub use frame::{Frame, GridFrame, Scalars, Vectors};
pub use mesh_file::MeshFile;
pub use options::{CreateSession, DecodeLimits, Delivery, Encoding, Precision, Scene, Wait, WatchOptions};
pub use pose::ColliderPose;
pub use reconnect::ReconnectPolicy;
pub use saved::SavedSession;
pub use selection::{
    Axis, Field, Fields, GridOptions, GridSelection, ParseFieldError, ParseGridError, holds_snow,
};
pub use step::Steps;
pub use topology::{Body, Topology, TopologyError};
pub use upload::{MeshError, MeshUpload, UploadedMesh};
pub use watch::{Event, FrameStream, SessionEnd};
pub use watch_diagnostics::{DiagnosticsEvent, DiagnosticsOptions, DiagnosticsStream};
