//! What a caller can ask for: sessions to create, frames to watch.
//!
//! Enters: the caller's choices. Leaves: request messages.

use nappe_proto::v1;
use uuid::Uuid;

use crate::{
    reconnect::ReconnectPolicy,
    selection::{Fields, GridOptions},
};

/// A session to create. 0 and `None` mean "as the scene says", or the session that was saved.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CreateSession {
    /// Its id: 1 to 63 letters (a-z, A-Z), digits and '-', which is not the first. Empty: the server chooses.
    pub session_id: String,
    /// What to simulate.
    pub scene: Scene,
    /// Precision of positions and velocities.
    pub precision: Option<Precision>,
    /// Threads; 0: as many as the server has cores.
    pub thread_count: u32,
    /// Steps after which the session ends by itself; 0: never.
    pub step_limit: Option<u64>,
    /// Steps between frames.
    pub frame_interval_steps: u32,
    /// Ranks of a cluster that step it, with so many threads each; 0: the server does.
    pub rank_count: u32,
    /// The frame that it begins at; none: it begins at the start of its scene.
    pub begin: Option<v1::Begin>,
}

impl CreateSession {
    /// A scene that the server ships.
    pub fn named(name: impl Into<String>) -> Self {
        Self { scene: Scene::Named(name.into()), ..Self::default() }
    }

    /// A scene file's text (TOML).
    pub fn from_text(text: impl Into<String>) -> Self {
        Self { scene: Scene::Text(text.into()), ..Self::default() }
    }

    /// The file of a session that was saved, by the id that [`crate::Client::upload_saved`] gave.
    pub fn from_saved(checkpoint_id: impl Into<String>) -> Self {
        Self { scene: Scene::Checkpoint(checkpoint_id.into()), ..Self::default() }
    }

    /// The message. Its request id makes a repeated request return the session of the first.
    pub(crate) fn into_request(self) -> v1::CreateSessionRequest {
        use v1::create_session_request::Scene as Wire;
        v1::CreateSessionRequest {
            session_id: self.session_id,
            scene: Some(match self.scene {
                Scene::Named(name) => Wire::SceneName(name),
                Scene::Text(text) => Wire::SceneText(text),
                Scene::Checkpoint(id) => Wire::CheckpointId(id),
            }),
            precision: match self.precision {
                None => v1::Precision::Unspecified,
                Some(Precision::F32) => v1::Precision::F32,
                Some(Precision::F64) => v1::Precision::F64,
            }
            .into(),
            thread_count: self.thread_count,
            step_limit: self.step_limit,
            frame_interval_steps: self.frame_interval_steps,
            rank_count: self.rank_count,
            begin: self.begin,
            request_id: Uuid::new_v4().to_string(),
        }
    }
}

/// Where a scene comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Scene {
    /// Name of a scene that the server ships.
    Named(String),
    /// A scene file's text (TOML).
    Text(String),
    /// The file of a session that was saved, by the id that [`crate::Client::upload_saved`] gave: the new session goes on from there.
    Checkpoint(String),
}

impl Default for Scene {
    fn default() -> Self {
        Self::Named("demo".to_owned())
    }
}

/// Precision of positions and velocities on the server. Sums are always binary64.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say everything")]
pub enum Precision {
    F32,
    F64,
}

/// When [`crate::Client::step`] and [`crate::Client::pause`] answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wait {
    /// When it is done, however long that takes.
    Yes,
    /// At once, whatever is still to be done.
    No,
}

/// How a stream of frames is wanted.
#[derive(Debug, Clone, Default)]
pub struct WatchOptions {
    /// Every frame, or the newest.
    pub delivery: Delivery,
    /// The first frame wanted, for [`Delivery::Every`]. `None`: the newest.
    pub from_frame: Option<u64>,
    /// Whether the session waits for this watcher, for [`Delivery::Every`], so that no frame is dropped before it came.
    pub pace_to_watcher: bool,
    /// Uid that the session must have; empty: any. A stream that comes back asks for the one that it began with.
    pub session_uid: String,
    /// Most frames per second, for [`Delivery::Latest`] (Hz); 0: no limit.
    pub max_rate_hz: f64,
    /// Arrays in each frame besides positions.
    pub fields: Fields,
    /// Nodes of the snow's grid in each frame, if wanted.
    pub grid: Option<GridOptions>,
    /// How arrays over the particles travel.
    pub encoding: Encoding,
    /// What to do when the connection breaks.
    pub reconnect: ReconnectPolicy,
    /// What the client agrees to hold in memory.
    pub limits: DecodeLimits,
}

impl WatchOptions {
    /// Every frame, in order, from frame `from_frame`.
    pub fn every_from(from_frame: u64) -> Self {
        Self { delivery: Delivery::Every, from_frame: Some(from_frame), ..Self::default() }
    }

    /// The newest frame, at most `max_rate_hz` times per second (Hz); 0: no limit.
    pub fn latest(max_rate_hz: f64) -> Self {
        Self { max_rate_hz, ..Self::default() }
    }

    /// The request for frames of a session.
    pub(crate) fn request(&self, session_id: &str, from_frame: Option<u64>) -> v1::WatchFramesRequest {
        v1::WatchFramesRequest {
            session_id: session_id.to_owned(),
            delivery: self.delivery.wire().into(),
            from_frame,
            pace_to_watcher: self.pace_to_watcher,
            max_rate_hz: self.max_rate_hz,
            fields: self.fields.request(),
            encoding: self.encoding.wire().into(),
            grid: self.grid.map(GridOptions::request),
            session_uid: self.session_uid.clone(),
        }
    }
}

/// Which frames reach a watcher.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Delivery {
    /// The newest whenever the watcher is ready; the others are dropped, and counted.
    #[default]
    Latest,
    /// Every frame, in order.
    Every,
}

impl Delivery {
    pub(crate) const fn wire(self) -> v1::Delivery {
        match self {
            Self::Latest => v1::Delivery::Latest,
            Self::Every => v1::Delivery::Every,
        }
    }
}

/// How arrays travel.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Encoding {
    /// binary32: 12 bytes per particle.
    #[default]
    F32,
    /// binary64: 24 bytes per particle, the exact state of a session in f64.
    F64,
}

impl Encoding {
    pub(crate) const fn wire(self) -> v1::Encoding {
        match self {
            Self::F32 => v1::Encoding::RawF32,
            Self::F64 => v1::Encoding::RawF64,
        }
    }
}

/// What the client agrees to hold in memory, whatever the server announces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DecodeLimits {
    /// Most particles per frame.
    pub max_particles: usize,
    /// Most bytes of all pieces of a topology together.
    pub max_topology_bytes: usize,
    /// Most nodes of the snow's grid per frame.
    pub max_grid_nodes: usize,
}

impl Default for DecodeLimits {
    /// 16 777 216 particles: 192 MiB of positions in binary32. 192 MiB of topology: the triangles and texture
    /// coordinates of a cloth of 6 million particles. 4 194 304 nodes of a grid: 112 MiB.
    fn default() -> Self {
        Self { max_particles: 1 << 24, max_topology_bytes: 192 << 20, max_grid_nodes: 1 << 22 }
    }
}
