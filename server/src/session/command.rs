//! What a session's thread can be told. Commands are read between two steps, never during one.

use nappe_proto::v1;
use nappe_sim::world::Change;
use tokio::sync::oneshot;

use crate::error::ServiceError;

/// Where the session's description goes when a command is carried out.
pub(crate) type Answer = oneshot::Sender<Result<v1::Session, ServiceError>>;

/// When a command to step is answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum When {
    /// When it is accepted.
    Accepted,
    /// When the steps are taken.
    Done,
}

/// A command.
#[derive(Debug)]
pub(crate) enum Command {
    /// Steps on.
    Play {
        /// Simulated seconds per second of wall clock; 0: as fast as possible.
        real_time_factor: f64,
        /// For the description.
        answer: Answer,
    },
    /// Stops stepping.
    Pause(Answer),
    /// Takes steps.
    Step {
        /// How many.
        count: u64,
        /// When to answer.
        when: When,
        /// For the description.
        answer: Answer,
    },
    /// Ends the simulation.
    Stop(Answer),
    /// Changes parameters.
    Update {
        /// Before the step of this index.
        at_step: u64,
        /// All or none of these.
        changes: Vec<Change>,
        /// For the index of the step before which they take effect.
        answer: oneshot::Sender<Result<u64, ServiceError>>,
    },
    /// Encodes the newest frame again with all that watchers now want, if its state stands.
    Provide(oneshot::Sender<()>),
    /// Ends the thread.
    End,
    /// Makes the next step panic (tests).
    InjectPanic,
}
