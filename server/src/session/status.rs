//! What can be read of a session while it steps: constants, progress, and the message made of both.

use std::sync::{Mutex, PoisonError};

use nappe_proto::v1;
use nappe_sim::math::Precision;

use super::transition::State;
use crate::stream::{Feed, wire};

/// What never changes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Facts {
    /// Id.
    pub id: String,
    /// Title of the scene.
    pub title: String,
    /// Time step (s).
    pub dt: f64,
    /// Ends after so many steps; 0: never by itself.
    pub step_limit: u64,
    /// Steps between two frames.
    pub frame_interval: u32,
    /// Frames between two state hashes.
    pub hash_interval: u32,
    /// Precision of the state.
    pub precision: Precision,
    /// Threads.
    pub thread_count: u32,
    /// Particles.
    pub particle_count: u64,
    /// Particles of snow: the last ones.
    pub snow_particle_count: u64,
    /// Springs.
    pub spring_count: u64,
    /// Side of the cells of the snow's grid (m); none without snow.
    pub snow_cell: Option<f64>,
}

/// How far it is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Progress {
    /// What it is doing.
    pub state: State,
    /// Steps taken.
    pub step: u64,
    /// Simulated time (s).
    pub time: f64,
    /// Hash of the state, when it is not stepping.
    pub state_hash: Option<u64>,
    /// Figures of the newest step.
    pub diagnostics: v1::Diagnostics,
    /// Wall-clock time spent stepping (s).
    pub stepping_seconds: f64,
    /// Why it failed.
    pub failure: Option<v1::Failure>,
}

/// Constants, progress and frames, shared by the thread and the handle.
#[derive(Debug)]
pub(crate) struct Status {
    /// What never changes.
    pub facts: Facts,
    /// Its frames.
    pub feed: std::sync::Arc<Feed>,
    progress: Mutex<Progress>,
}

impl Status {
    /// The status of a session that has just been made.
    pub(crate) fn new(facts: Facts, feed: std::sync::Arc<Feed>, progress: Progress) -> Self {
        Self { facts, feed, progress: Mutex::new(progress) }
    }

    /// Changes the progress.
    pub(crate) fn update(&self, change: impl FnOnce(&mut Progress)) {
        change(&mut self.progress.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// The progress as of now.
    pub(crate) fn progress(&self) -> Progress {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The message, but for the number of watchers.
    pub(crate) fn describe(&self) -> v1::Session {
        let (progress, newest, facts) = (self.progress(), self.feed.newest(), &self.facts);
        v1::Session {
            session_id: facts.id.clone(),
            title: facts.title.clone(),
            state: wire_state(progress.state).into(),
            failure: progress.failure,
            step: progress.step,
            time_seconds: progress.time,
            frame: newest.frame.head.frame,
            oldest_frame: newest.oldest,
            dt_seconds: facts.dt,
            step_limit: facts.step_limit,
            frame_interval_steps: facts.frame_interval,
            precision: wire::precision(facts.precision).into(),
            thread_count: facts.thread_count,
            particle_count: facts.particle_count,
            spring_count: facts.spring_count,
            watcher_count: 0,
            state_hash: progress.state_hash,
            diagnostics: Some(progress.diagnostics),
            stepping_seconds: progress.stepping_seconds,
            snow_particle_count: facts.snow_particle_count,
        }
    }
}

fn wire_state(state: State) -> v1::SessionState {
    match state {
        State::Paused => v1::SessionState::Paused,
        State::Playing | State::Stepping { .. } => v1::SessionState::Playing,
        State::Finished => v1::SessionState::Finished,
        State::Failed => v1::SessionState::Failed,
    }
}
