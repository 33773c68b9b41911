//! A model of what calls to one session are answered: from when each call was made and answered, which answers are
//! allowed.
//!
//! A call that nobody disturbs on a session that stands has one answer. Of calls at the same time, the model knows
//! only that each takes effect at some moment between its request and its answer.

use nappe_proto::v1::SessionState;
use nappe_server::Reason;

/// What a client asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Call {
    /// At so many simulated seconds per second; 0: as fast as possible.
    Play(f64),
    Pause,
    /// So many more steps.
    Step(u64),
    /// Until so many steps were taken since the start.
    StepTo(u64),
    Stop,
    Delete,
    Fork,
}

impl Call {
    fn is_step(self) -> bool {
        matches!(self, Self::Step(_) | Self::StepTo(_))
    }

    /// Whether it may have the session go on.
    fn moves(self) -> bool {
        self.is_step() || matches!(self, Self::Play(_))
    }
}

/// What an answer shows of a session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shown {
    pub(crate) state: SessionState,
    pub(crate) step: u64,
    pub(crate) is_hashed: bool,
    /// The step of the frame that came with it.
    pub(crate) frame_step: Option<u64>,
}

/// A call and its answer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Answered {
    pub(crate) call: Call,
    pub(crate) waits: bool,
    pub(crate) has_frame: bool,
    /// When it was made and when it was answered, by one clock of all clients.
    pub(crate) asked: u64,
    pub(crate) replied: u64,
    /// Nothing is shown of a session that was deleted.
    pub(crate) answer: Result<Option<Shown>, Reason>,
}

impl Answered {
    fn shown(&self) -> Option<Shown> {
        self.answer.ok().flatten()
    }

    /// Whether the session stood when it was answered; a fork says nothing of it.
    fn stood(&self) -> bool {
        let stands = |shown: Shown| shown.state == SessionState::Paused && shown.is_hashed;
        self.waits && self.call != Call::Fork && self.shown().is_some_and(stands)
    }
}

/// The calls to one session, and after how many steps it ends by itself.
pub(crate) struct History {
    pub(crate) calls: Vec<Answered>,
    pub(crate) limit: Option<u64>,
}

impl History {
    /// The first call whose answer is not allowed, and why not.
    pub(crate) fn fault(&self) -> Option<String> {
        let told = |at: usize| self.fault_of(at).map(|fault| format!("{fault}: {:?}", self.calls[at]));
        (0..self.calls.len()).find_map(told)
    }

    fn fault_of(&self, at: usize) -> Option<&'static str> {
        let own = &self.calls[at];
        if let Some(step) = self.undisturbed(at) {
            return self.fault_alone(own, step);
        }
        match own.answer {
            Ok(Some(shown)) => self.fault_of_shown(at, shown),
            Ok(None) => None,
            Err(reason) => (!self.allows(at, reason)).then_some("this reason is not allowed"),
        }
    }

    fn others(&self, at: usize) -> impl Iterator<Item = &Answered> {
        self.calls.iter().enumerate().filter(move |(other, _)| *other != at).map(|(_, call)| call)
    }

    /// The others that took effect before a call was made.
    fn before(&self, at: usize) -> impl Iterator<Item = &Answered> {
        let asked = self.calls[at].asked;
        self.others(at).filter(move |other| other.replied < asked)
    }

    /// The others that may have taken effect before a call was answered.
    fn so_far(&self, at: usize) -> impl Iterator<Item = &Answered> {
        let answered = self.calls[at].replied;
        self.others(at).filter(move |other| other.asked < answered)
    }

    /// The others that may have taken effect between a call and its answer.
    fn meanwhile(&self, at: usize) -> impl Iterator<Item = &Answered> {
        let asked = self.calls[at].asked;
        self.so_far(at).filter(move |other| other.replied > asked)
    }

    /// The step at which the session surely stands until this call takes effect, alone.
    fn undisturbed(&self, at: usize) -> Option<u64> {
        let own = &self.calls[at];
        let rest = self.before(at).filter(|other| other.stood()).max_by_key(|other| other.replied)?;
        let keeps_out = |other: &Answered| {
            other.call == Call::Fork
                || other.asked == rest.asked
                || other.replied < rest.asked
                || other.asked > own.replied
        };
        self.others(at).all(keeps_out).then_some(rest.shown()?.step)
    }

    /// What is wrong with the answer of a call to a session that stood at `step`.
    fn fault_alone(&self, own: &Answered, step: u64) -> Option<&'static str> {
        if own.call == Call::Delete {
            return (own.answer != Ok(None)).then_some("it can be deleted");
        }
        let Ok(Some(shown)) = own.answer else { return Some("nothing stands against it") };
        if !own.waits {
            return (shown.step < step).then_some("steps are never undone");
        }
        let end = match own.call {
            Call::Step(count) => step + count,
            Call::StepTo(target) => target.max(step),
            _ => step,
        };
        let end = self.limit.map_or(end, |limit| end.min(limit));
        let is_at_limit = own.call.is_step() && self.limit == Some(end);
        let state = match own.call {
            Call::Play(_) => SessionState::Playing,
            Call::Stop => SessionState::Finished,
            _ if is_at_limit => SessionState::Finished,
            _ => SessionState::Paused,
        };
        let is_playing = state == SessionState::Playing;
        let frame_step = own.has_frame.then_some(end);
        if is_playing && shown.state == state && shown.step >= step {
            return None;
        }
        let expected = Shown { state, step: end, is_hashed: true, frame_step };
        (shown != expected).then_some("nobody disturbs it")
    }

    /// Whether the session may have ended before a call was answered.
    fn may_end(&self, at: usize) -> bool {
        let is_stop = self.calls[at].call == Call::Stop;
        is_stop || self.limit.is_some() || self.so_far(at).any(|other| other.call == Call::Stop)
    }

    /// Whether a call may find the session playing.
    fn may_play(&self, at: usize) -> bool {
        let pauses: Vec<_> = self.before(at).filter(|other| other.call == Call::Pause).collect();
        let goes_on = |play: &Answered| pauses.iter().all(|pause| pause.asked < play.replied);
        self.so_far(at).any(|other| matches!(other.call, Call::Play(_)) && goes_on(other))
    }

    /// Whether a call may be refused for this reason.
    fn allows(&self, at: usize, reason: Reason) -> bool {
        let own = &self.calls[at];
        let cuts = |other: &Answered| matches!(other.call, Call::Play(_) | Call::Pause | Call::Stop);
        match reason {
            Reason::SessionDeleted => self.meanwhile(at).any(|other| other.call == Call::Delete),
            Reason::SessionNotFound => self.so_far(at).any(|other| other.call == Call::Delete),
            Reason::SessionFinished => own.call.moves() && self.may_end(at),
            Reason::SessionPlaying => own.call.is_step() && self.may_play(at),
            Reason::StepsInterrupted => {
                // A frame of a state that the session has left cannot be made.
                let has_passed = own.has_frame && self.so_far(at).any(|other| other.call.moves());
                own.call.is_step() && own.waits && (has_passed || self.meanwhile(at).any(cuts))
            }
            _ => false,
        }
    }

    /// What is wrong with an answer that shows a session.
    fn fault_of_shown(&self, at: usize, shown: Shown) -> Option<&'static str> {
        use SessionState::{Finished, Paused, Playing};
        let own = &self.calls[at];
        let least = self.before(at).filter_map(Answered::shown).map(|shown| shown.step).max().unwrap_or(0);
        let was = |call: Call| self.before(at).any(|other| other.call == call && other.answer.is_ok());
        let others_move = self.so_far(at).any(|other| other.call.moves());
        let moved_meanwhile = self.meanwhile(at).any(|other| other.call.moves());
        let target = match own.call {
            Call::Step(count) if own.waits => least + count,
            Call::StepTo(target) if own.waits => target,
            _ => 0,
        };
        let target = self.limit.map_or(target, |limit| target.min(limit));
        // The session stands at its start as after a pause, but that leaves no step in progress.
        let is_paused = self.so_far(at).any(|other| other.call == Call::Pause && other.asked > 0);

        let rules = [
            (was(Call::Delete), "the session was deleted"),
            (shown.step < least, "steps are never undone"),
            (shown.step < target, "its steps are not taken"),
            (self.limit.is_some_and(|limit| shown.step > limit), "it ends before"),
            (own.has_frame && shown.frame_step != Some(shown.step), "its frame is another one"),
            (shown.state == Finished && !self.may_end(at), "nothing ended it"),
            (shown.state == Finished && !shown.is_hashed, "its end has a hash"),
            (shown.state != Finished && own.call == Call::Stop, "it is stopped"),
            (shown.state != Finished && own.call != Call::Fork && was(Call::Stop), "it was stopped before"),
            (shown.state != Playing && matches!(own.call, Call::Play(_)), "it plays"),
            (shown.state != Paused && own.call == Call::Fork, "a fork is paused"),
            (
                shown.state == Playing && own.waits && own.call == Call::Pause && !moved_meanwhile,
                "it was paused",
            ),
            (shown.state == Playing && own.waits && own.call.is_step() && !others_move, "its steps end"),
            (shown.state == Paused && own.waits && own.call == Call::Pause && !shown.is_hashed, "it stands"),
            (
                shown.state == Paused && own.waits && own.call.is_step() && !shown.is_hashed && !is_paused,
                "it stands after its steps",
            ),
        ];
        rules.into_iter().find_map(|(is_wrong, why)| is_wrong.then_some(why))
    }
}
