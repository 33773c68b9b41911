//! What can be read of a session while it steps: properties, progress, and the message made of both.

use std::{
    sync::{Arc, Mutex, PoisonError},
    time::SystemTime,
};

use nappe_proto::v1;
use nappe_sim::{math::Precision, world::Change};
use uuid::Uuid;

use super::transition::State;
use crate::{scenes::Origin, stream::Feed};

/// What never changes during a session.
#[derive(Clone, Debug)]
pub(crate) struct Properties {
    pub id: String,
    /// Never given to another session.
    pub uid: String,
    pub create_time: SystemTime,
    /// Title of the scene.
    pub title: String,
    /// Colours that the scene gives to bodies, by their names, as messages have them.
    pub colors: Arc<[(String, u32)]>,
    pub dt_seconds: f64,
    /// The session ends after this many steps; 0: never by itself.
    pub step_limit: u64,
    /// Steps between frames, 1 or more.
    pub frame_interval_steps: u32,
    /// Frames between state hashes, 1 or more.
    pub hash_interval: u32,
    pub precision: Precision,
    pub thread_count: u32,
    /// Particles of cloth and snow together.
    pub particle_count: u64,
    /// Particles of snow: the last ones.
    pub snow_particle_count: u64,
    pub spring_count: u64,
    /// Side of the cells of the snow's grid (m); none without snow.
    pub snow_cell: Option<f64>,
    /// Changes with which it begins: moving pins.
    pub initial_changes: Arc<[Change]>,
    /// What it was made from.
    pub origin: Arc<Origin>,
    /// Whether its origin is that of another session, of which it is a copy.
    pub is_copy: bool,
    /// Memory of the server that is counted for it (bytes).
    pub claimed_bytes: u64,
    /// Those of them that are counted for its snow, before that grows.
    pub claimed_snow_bytes: u64,
    /// Those of them that are counted for ways of colliders and pins, before calls give others.
    pub claimed_way_bytes: u64,
}

impl Properties {
    /// The same of a session that is made now.
    pub(super) fn of_new_session(self, id: String) -> Self {
        Self { id, uid: new_uid(), create_time: SystemTime::now(), is_copy: true, ..self }
    }
}

/// A uid that no session has had.
pub(super) fn new_uid() -> String {
    Uuid::new_v4().to_string()
}

/// How far a session is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Progress {
    pub state: State,
    /// Steps since the start.
    pub step: u64,
    /// Simulated time (s).
    pub time_seconds: f64,
    /// Hash of the state, while the session is not stepping.
    pub state_hash: Option<u64>,
    /// Diagnostics of the newest step.
    pub diagnostics: v1::Diagnostics,
    /// The largest stretch of a spring since the session was made, and when it was (s).
    pub largest_stretch: [f64; 2],
    /// Wall-clock time spent stepping.
    pub stepping_seconds: f64,
    /// Parameters of the newest step.
    pub parameters: v1::Parameters,
    /// Why the session failed, if it did.
    pub failure: Option<v1::Failure>,
    /// The ranks that step it, where the server does not.
    pub ranks: Option<v1::SessionRanks>,
}

/// Properties, progress and frames, shared by a session's thread and its handle.
#[derive(Debug)]
pub(crate) struct Status {
    pub properties: Properties,
    pub feed: Arc<Feed>,
    progress: Mutex<Progress>,
}

impl Status {
    pub(crate) fn new(properties: Properties, feed: Arc<Feed>, progress: Progress) -> Self {
        Self { properties, feed, progress: Mutex::new(progress) }
    }

    /// Changes the progress. Watchers are told of another state.
    pub(crate) fn update(&self, change: impl FnOnce(&mut Progress)) {
        let mut progress = self.progress.lock().unwrap_or_else(PoisonError::into_inner);
        let before = state_message(progress.state);
        change(&mut progress);

        let state = state_message(progress.state);
        if state != before {
            self.feed.note_state(state, progress.failure.clone(), progress.step);
        }
    }

    /// The progress as of now.
    pub(crate) fn progress(&self) -> Progress {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The session's message without the number of watchers and what is kept of it, which the handle knows.
    pub(crate) fn describe(&self) -> v1::Session {
        let (progress, newest, properties) = (self.progress(), self.feed.newest(), &self.properties);
        let [largest_stretch, largest_stretch_seconds] = progress.largest_stretch;
        v1::Session {
            session_id: properties.id.clone(),
            title: properties.title.clone(),
            state: state_message(progress.state).into(),
            failure: progress.failure,
            step: progress.step,
            time_seconds: progress.time_seconds,
            frame: newest.frame.head.frame,
            oldest_frame: newest.oldest,
            dt_seconds: properties.dt_seconds,
            step_limit: properties.step_limit,
            frame_interval_steps: properties.frame_interval_steps,
            precision: precision_message(properties.precision).into(),
            thread_count: properties.thread_count,
            particle_count: properties.particle_count,
            spring_count: properties.spring_count,
            watcher_count: 0,
            state_hash: progress.state_hash,
            diagnostics: Some(progress.diagnostics),
            stepping_seconds: progress.stepping_seconds,
            snow_particle_count: properties.snow_particle_count,
            uid: properties.uid.clone(),
            create_time: Some(properties.create_time.into()),
            parameters: Some(progress.parameters),
            expires_in_seconds: None,
            ranks: progress.ranks,
            largest_stretch,
            largest_stretch_seconds,
            durability: None,
        }
    }
}

fn state_message(state: State) -> v1::SessionState {
    match state {
        State::Paused => v1::SessionState::Paused,
        State::Playing | State::Stepping { .. } => v1::SessionState::Playing,
        State::Finished => v1::SessionState::Finished,
        State::Failed => v1::SessionState::Failed,
    }
}

fn precision_message(precision: Precision) -> v1::Precision {
    match precision {
        Precision::F32 => v1::Precision::F32,
        Precision::F64 => v1::Precision::F64,
    }
}
