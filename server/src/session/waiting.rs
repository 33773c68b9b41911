//! Calls that wait for a session, bounded in number, and what answers each of them: one table, [`For::verdict`].

use std::sync::Arc;

use nappe_proto::v1;
use tokio::sync::oneshot;

use super::{failure::interrupted, transition::State};
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
    /// That the session stands, and the hash of its state is known.
    Rest,
    /// That so many steps were taken since the start.
    Steps(u64),
    /// The end of the simulation.
    End,
    /// That the step of this index begins, from 0.
    Begin(u64),
}

/// How a session stands, as far as calls wait for it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Standing {
    pub state: State,
    /// Steps that were taken.
    pub taken: u64,
    /// Steps that have begun: those that were taken, and the one in progress.
    pub begun: u64,
    /// Whether the session stands, the hash of its state is known, and an end has been told.
    pub is_settled: bool,
}

/// What a call that waits is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Nothing: its time has not come.
    Waits,
    /// The session as it is.
    Happened,
    /// That its steps are not taken.
    CutShort,
}

impl For {
    /// What a call that waits for this is told while the session stands so. A session that failed or was deleted has
    /// told every call.
    #[allow(clippy::match_same_arms, reason = "one line per rule, grouped by what is waited for")]
    pub(super) fn verdict(self, now: Standing) -> Verdict {
        use State::{Failed, Finished, Paused, Playing, Stepping};
        use Verdict::{CutShort, Happened, Waits};
        let once_settled = |verdict| if now.is_settled { verdict } else { Waits };
        match (self, now.state) {
            // Another call has it go on, perhaps not before a long time.
            (Self::Rest, Playing | Stepping { .. }) => Happened,
            (Self::Rest, Paused | Finished | Failed) => once_settled(Happened),

            // The hash is worth a moment where the session stands there.
            (Self::Steps(target), state) if now.taken >= target => {
                let has_passed = state.is_stepping() || now.begun > now.taken;
                if has_passed { Happened } else { once_settled(Happened) }
            }
            (Self::Steps(_), Stepping { .. }) => Waits,
            // What has begun is taken, whoever paused or played since.
            (Self::Steps(target), Playing | Paused) if now.begun >= target => Waits,
            (Self::Steps(_), Playing | Paused) => CutShort,
            (Self::Steps(_), Finished | Failed) => once_settled(CutShort),

            (Self::End, Finished | Failed) => once_settled(Happened),
            (Self::End, Paused | Playing | Stepping { .. }) => Waits,

            (Self::Begin(index), _) if now.begun > index => Happened,
            (Self::Begin(_), Finished | Failed) => once_settled(CutShort),
            (Self::Begin(_), Paused | Playing | Stepping { .. }) => Waits,
        }
    }
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

    /// Whether the time of one has come.
    pub(super) fn is_due(&self, now: Standing) -> bool {
        self.0.iter().any(|(what, _)| what.verdict(now) != Verdict::Waits)
    }

    /// Answers those whose time has come; `describe` gives the session as it is.
    pub(super) fn answer(&mut self, now: Standing, describe: impl Fn() -> v1::Session) {
        for (what, answer) in self.0.extract_if(.., |(what, _)| what.verdict(now) != Verdict::Waits) {
            let session = describe();
            let outcome = match what.verdict(now) {
                Verdict::CutShort => Err(interrupted(&session.session_id, now.begun)),
                Verdict::Happened | Verdict::Waits => Ok(session),
            };
            // Whoever asked may be gone.
            let _ = answer.send(outcome);
        }
    }

    /// Tells all that wait why nothing of it will happen.
    pub(super) fn fail(&mut self, error: &ServiceError) {
        for (_, answer) in self.0.drain(..) {
            // Whoever asked may be gone.
            let _ = answer.send(Err(error.clone()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{
        Verdict::{CutShort, Happened, Waits},
        *,
    };

    const STEPPING: State = State::Stepping { remaining: 3 };

    /// A session that has taken 5 steps, and begun one more if `begun` is 6.
    fn standing(state: State, begun: u64) -> Standing {
        Standing { state, taken: 5, begun, is_settled: false }
    }

    /// The same, settled.
    fn settled(state: State, begun: u64) -> Standing {
        Standing { is_settled: true, ..standing(state, begun) }
    }

    /// The table of docs/service.md: a row for each way to stand, a cell for each thing to wait for.
    #[test]
    fn every_call_is_answered_as_the_table_says() {
        let calls = [For::Rest, For::Steps(5), For::Steps(6), For::Steps(7), For::End, For::Begin(5)];
        let rows = [
            (settled(State::Paused, 5), [Happened, Happened, CutShort, CutShort, Waits, Waits]),
            (standing(State::Paused, 5), [Waits, Waits, CutShort, CutShort, Waits, Waits]),
            (standing(State::Paused, 6), [Waits, Happened, Waits, CutShort, Waits, Happened]),
            (standing(State::Playing, 5), [Happened, Happened, CutShort, CutShort, Waits, Waits]),
            (standing(State::Playing, 6), [Happened, Happened, Waits, CutShort, Waits, Happened]),
            (standing(STEPPING, 5), [Happened, Happened, Waits, Waits, Waits, Waits]),
            (standing(STEPPING, 6), [Happened, Happened, Waits, Waits, Waits, Happened]),
            (standing(State::Finished, 5), [Waits; 6]),
            (settled(State::Finished, 5), [Happened, Happened, CutShort, CutShort, Happened, CutShort]),
            (settled(State::Failed, 5), [Happened, Happened, CutShort, CutShort, Happened, CutShort]),
        ];
        for (now, row) in rows {
            for (call, expected) in calls.into_iter().zip(row) {
                assert_eq!(call.verdict(now), expected, "{call:?} while {now:?}");
            }
        }
    }
}
