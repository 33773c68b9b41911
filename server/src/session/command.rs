//! What a session's thread can be asked to do. Commands are read between steps, never during one.

use nappe_proto::v1;
use nappe_sim::world::Change;
use tokio::sync::oneshot;

use crate::error::ServiceError;

/// Commands that wait for the session's thread at a time, and that it reads between two steps.
pub(super) const MAX_COMMANDS: usize = 64;

/// Where the session's description goes once a command is carried out.
pub(crate) type Answer = oneshot::Sender<Result<v1::Session, ServiceError>>;

/// When a command to step is answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum When {
    /// Once the command is accepted.
    Accepted,
    /// Once the steps are taken.
    Done,
}

/// Which steps a command asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Steps {
    /// So many more, 1 or more.
    More(u64),
    /// Until so many were taken since the start; none if they were.
    Until(u64),
}

#[derive(Debug)]
pub(crate) enum Command {
    /// Steps until paused, stopped or at the end.
    Play {
        /// Simulated seconds per second of wall clock; 0: as fast as possible.
        real_time_factor: f64,
        answer: Answer,
    },
    Pause(Answer),
    Step {
        steps: Steps,
        when: When,
        answer: Answer,
    },
    /// Ends the simulation; the session stays readable.
    Stop(Answer),
    /// Changes parameters of the simulation.
    Update {
        /// Index of the step before which they take effect; past or 0: the next step.
        at_step: u64,
        /// Applied all or none.
        changes: Vec<Change>,
        /// Where the index of that step goes.
        answer: oneshot::Sender<Result<u64, ServiceError>>,
    },
    /// Encodes the newest frame again with everything that watchers want now, if its state stands.
    CompleteNewest(oneshot::Sender<()>),
    /// Ends the thread: the session is deleted.
    End,
    /// Makes the next step panic (tests).
    InjectPanic,
}

impl Command {
    /// Whether whoever asked is gone: what he asked for is not carried out then.
    pub(super) fn is_abandoned(&self) -> bool {
        match self {
            Self::Play { answer, .. }
            | Self::Step { answer, .. }
            | Self::Pause(answer)
            | Self::Stop(answer) => answer.is_closed(),
            Self::Update { answer, .. } => answer.is_closed(),
            Self::CompleteNewest(answer) => answer.is_closed(),
            Self::End | Self::InjectPanic => false,
        }
    }
}
