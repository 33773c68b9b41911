//! Calls that wait for a session, bounded in number.

use std::sync::Arc;

use nappe_proto::v1;
use tokio::sync::oneshot;

use crate::{
    error::ServiceError,
    stream::{EncodedFrame, FieldSet},
};

/// Calls that wait for a session at a time.
pub(super) const MAX_WAITING: usize = 64;

/// Where the session's description goes once what a call waits for has happened.
pub(crate) type Answer = oneshot::Sender<Result<v1::Session, ServiceError>>;

/// A frame that the answer of a call has, of the state at which the session stands after the call's steps.
#[derive(Debug)]
pub(super) struct FrameWish {
    pub fields: FieldSet,
    /// Steps taken in that state. A session that goes on from there before the frame is made leaves the wish unmet.
    pub step: u64,
    pub done: oneshot::Sender<Arc<EncodedFrame>>,
}

/// What a call waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum For {
    /// The steps that were asked for.
    Steps,
    /// That the session stands, and the hash of its state is known.
    Rest,
    /// The end of the simulation.
    End,
    /// The step before which changes take effect.
    Step(u64),
}

/// The calls that wait.
#[derive(Debug, Default)]
pub(super) struct Waiting(Vec<(For, Answer)>);

impl Waiting {
    /// Whether one more may wait beside `others`; those whose callers are gone are forgotten.
    pub(super) fn has_room(&mut self, others: usize) -> bool {
        self.0.retain(|(_, answer)| !answer.is_closed());
        self.0.len() + others < MAX_WAITING
    }

    pub(super) fn push(&mut self, what: For, answer: Answer) {
        self.0.push((what, answer));
    }

    /// Makes those who wait for `from` wait for `to`.
    pub(super) fn turn(&mut self, from: For, to: For) {
        self.0.iter_mut().filter(|(what, _)| *what == from).for_each(|(what, _)| *what = to);
    }

    /// Answers those who wait for what `happened` names.
    pub(super) fn answer(
        &mut self,
        happened: impl Fn(For) -> bool,
        outcome: &Result<v1::Session, ServiceError>,
    ) {
        for (_, answer) in self.0.extract_if(.., |(what, _)| happened(*what)) {
            // Whoever asked may be gone.
            let _ = answer.send(outcome.clone());
        }
    }
}
