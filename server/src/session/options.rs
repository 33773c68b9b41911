//! What a session is made from, as a request asks for it.

use nappe_proto::v1;
use nappe_sim::math::Precision;

use super::{ranks::RankCounts, saved_frame::SavedFrame};

/// What a session is made from.
#[derive(Clone, Debug)]
pub(crate) struct SessionOptions {
    pub id: String,
    /// The request, which says the same.
    pub request: v1::CreateSessionRequest,
    /// The text of the scene.
    pub scene_text: String,
    /// What the scene is called in messages.
    pub scene_name: String,
    /// `None`: as the scene says.
    pub precision: Option<Precision>,
    /// Threads, 1 or more.
    pub thread_count: u32,
    /// The session ends after this many steps, 0: never; none: as the scene says.
    pub step_limit: Option<u64>,
    /// Steps between frames; 0: as the scene says.
    pub frame_interval_steps: u32,
    /// Ranks that step it; none: the server does.
    pub ranks: Option<RankCounts>,
    /// The frame that it begins at; none: it begins at the start of its scene.
    pub begin: Option<SavedFrame>,
}
