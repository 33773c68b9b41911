//! A session that outlives its server: it is kept in a folder from its start to its deletion.

use std::time::Duration;

use nappe_proto::v1;

use super::{
    control::Control,
    handle::Session,
    keeper::{KeepPlace, keep},
    stepper::Stepper,
};
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
    state::{Goal, Record, Replay, SessionFolder, StatePlace, Waiting},
    stream::Ending,
};

/// Where a session was kept that goes on in another server.
#[derive(Clone, Debug)]
pub(crate) struct Keeping {
    pub folder: SessionFolder,
    /// Time between two states, if something happened.
    pub interval: Duration,
    /// The highest number of a state or a log.
    pub last_number: u64,
    /// What the logs since the state say.
    pub records: Vec<Record<'static>>,
}

/// The same, once its records were read.
pub(super) struct Kept {
    folder: SessionFolder,
    interval: Duration,
    newest: StatePlace,
    replay: Replay,
}

impl Kept {
    /// Of a session that had taken so many steps, with such changes that wait: those come to them that were asked for since.
    pub(super) fn of(keeping: Keeping, taken: u64, waiting: &mut Waiting) -> Self {
        let Keeping { folder, interval, last_number, records } = keeping;
        let replay = Replay::of(records, taken, waiting);
        let newest = StatePlace { number: last_number, step: taken };
        Self { folder, interval, newest, replay }
    }
}

/// A session that is being made: if who makes it is gone before it is kept, nobody knows it, and nothing of it stays.
struct Unmade<'a>(Option<&'a Control>);

impl Drop for Unmade<'_> {
    fn drop(&mut self) {
        if let Some(control) = self.0 {
            control.delete();
        }
    }
}

impl Session {
    /// Keeps the session from now on in a folder, with a state every `interval` if something happened. It is kept once this is done,
    /// unless something is in the way, of which the log is told: the session goes on all the same.
    pub(crate) async fn keep(&self, folder: SessionFolder, interval: Duration, limits: &Limits) {
        let step = self.step_count();
        let newest = StatePlace { number: 0, step };
        let place = KeepPlace { folder, interval, newest, goal: Goal::Stand { step } };
        match keep(&self.control, place, limits) {
            Ok(keep) => {
                let mut unmade = Unmade(Some(&self.control));
                // Whether it could be written, the log is told.
                let _ = self.control.begin_keeping(keep).await;
                unmade.0 = None;
            }
            Err(error) => tracing::warn!(session = self.id(), "it is not kept: {error}"),
        }
    }

    /// The request that made it, or the session of which it is a copy; none where that is not known.
    pub(crate) fn request(&self) -> Option<&v1::CreateSessionRequest> {
        self.status.properties.origin.request.as_ref()
    }

    /// Whether it is kept in a folder.
    pub(crate) fn is_kept(&self) -> bool {
        self.control.is_kept()
    }

    /// Tells the thread to end after the step in progress: the session stays where it is kept. One that is kept nowhere ends at once.
    pub(crate) fn leave(&self) {
        if self.control.is_kept() {
            self.control.leave();
        } else {
            self.end();
        }
    }

    /// Gives up the step in progress of a session that is to end.
    pub(crate) fn hurry(&self) {
        self.control.interrupt();
    }
}

impl Drop for Session {
    /// A session that nobody holds, since its maker was gone before he got it, or its server ends, ends.
    fn drop(&mut self) {
        self.control.leave();
        self.control.interrupt();
    }
}

impl Stepper {
    /// Goes on with what a folder has of the session, which stands at a state of it: with what it did and was asked since.
    pub(super) fn go_on(&self, kept: &Kept, limits: &Limits) {
        let Kept { folder, interval, newest, replay } = kept;
        let goal = replay.goal.unwrap_or(Goal::Stand { step: newest.step });
        let place = KeepPlace { folder: folder.clone(), interval: *interval, newest: *newest, goal };
        match keep(&self.control, place, limits) {
            Ok(keep) => self.control.go_on(keep, replay),
            Err(error) => tracing::warn!(session = self.status().properties.id, "it is not kept: {error}"),
        }
        if let Some(failure) = &replay.failure {
            // No frame comes after that of the state.
            self.has_failed(failure.clone());
        } else if let Some((frame, _)) = replay.last_frame {
            self.status().feed.begin_at(frame);
        }
    }

    /// The session failed before.
    fn has_failed(&self, failure: v1::Failure) {
        let reason = Reason::of(&failure.reason).unwrap_or(Reason::Internal);
        let error = ServiceError::new(reason, failure.message.clone())
            .with("session_id", &self.status().properties.id)
            .with("step", failure.step);
        self.control.failed(&error, failure, self.simulator.hash_if_intact());
        self.status().feed.end(Ending::Broken(error));
    }
}
