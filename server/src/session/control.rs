//! What a session is asked to do: shared by the calls that ask and the thread that steps.
//!
//! Enters: calls, which take effect at once and never wait for a step in progress; outcomes of steps. Leaves: what
//! the thread does next. A call that wants to wait leaves a place for its answer.

use std::{
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    time::Instant,
};

use nappe_proto::v1;
use nappe_sim::{
    interrupt::Interrupt,
    world::{Change, ChangeRules},
};
use tokio::sync::oneshot;

use super::{
    failure::{interrupted, refused},
    pace::Pace,
    pending_changes::{Accepted, PendingChange, PendingChanges},
    status::Status,
    transition::{Effect, Event, State, transition},
    waiting::{Answer, For, MAX_WAITING, Waiting},
};
use crate::error::{Reason, ServiceError};

/// Steps that a change may lie ahead.
const MAX_STEPS_AHEAD: u64 = 10_000_000;

/// How a session is controlled.
#[derive(Debug)]
pub(super) struct Control {
    pub(super) status: Arc<Status>,
    rules: Arc<ChangeRules>,
    interrupt: Interrupt,
    desk: Mutex<Desk>,
    /// Tells the thread that the desk has changed.
    pub(super) changed: Condvar,
}

/// What calls and thread share, each for a moment.
#[derive(Debug)]
pub(super) struct Desk {
    pub(super) state: State,
    pub(super) pace: Pace,
    /// Index of the first step that has not begun.
    pub(super) next_step: u64,
    pub(super) in_progress: InProgress,
    pub(super) pending: PendingChanges,
    pub(super) waiting: Waiting,
    /// Who waits for the newest frame with more fields.
    pub(super) completions: Vec<oneshot::Sender<()>>,
    pub(super) ending: Ending,
    /// Whether the hash of the state at which the session stands is known.
    pub(super) is_settled: bool,
    pub(super) injected: Injected,
}

/// Whether something is to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Ending {
    Nothing,
    /// The simulation; the session stays readable.
    Simulation,
    /// The thread: the session is deleted.
    Thread,
}

/// Whether what the thread does next panics, as a bug would (tests).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Injected {
    #[default]
    Nothing,
    Panic,
}

impl Injected {
    pub(super) fn carry_out(self) {
        assert!(self == Self::Nothing, "a panic was injected for a test");
    }
}

/// Whether a step is in progress.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum InProgress {
    Nothing,
    /// One of the steps that the state asks for.
    Asked,
    /// A step that had begun when the session was paused.
    Left,
}

/// Which steps a call asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Steps {
    /// So many more, 1 or more.
    More(u64),
    /// Until so many were taken since the start; none if they were.
    Until(u64),
}

impl Desk {
    /// Steps that will have been taken once the session stands, if nobody asks for more.
    fn coming_step(&self) -> u64 {
        let begun = u64::from(self.in_progress == InProgress::Asked);
        match self.state {
            State::Stepping { remaining } => self.next_step.saturating_add(remaining - begun),
            _ => self.next_step,
        }
    }
}

impl Control {
    /// Of a session that stands, paused, before its first step.
    pub(super) fn new(
        status: Arc<Status>,
        rules: Arc<ChangeRules>,
        interrupt: Interrupt,
        max_pending_changes: u32,
    ) -> Self {
        let progress = status.progress();
        let desk = Desk {
            state: State::Paused,
            pace: Pace::start(0.0, Instant::now(), progress.time_seconds),
            next_step: progress.step,
            in_progress: InProgress::Nothing,
            pending: PendingChanges::new(max_pending_changes),
            waiting: Waiting::default(),
            completions: Vec::new(),
            ending: Ending::Nothing,
            is_settled: true,
            injected: Injected::Nothing,
        };
        Self { status, rules, interrupt, desk: Mutex::new(desk), changed: Condvar::new() }
    }

    /// Steps from now on at `real_time_factor` simulated seconds per second; 0: as fast as possible.
    pub(super) fn play(&self, real_time_factor: f64) -> Result<v1::Session, ServiceError> {
        let mut desk = self.lock();
        self.change(&mut desk, Event::Play)?;
        self.set_pace(&mut desk, real_time_factor);
        Ok(self.status.describe())
    }

    /// Pauses after the step in progress. Returns the session as of now, and the steps that it will have taken; the
    /// answer comes once it stands there.
    pub(super) fn pause(&self, answer: Option<Answer>) -> Result<(v1::Session, u64), ServiceError> {
        let mut desk = self.lock();
        self.check_room(&mut desk, answer.as_ref())?;
        self.change(&mut desk, Event::Pause)?;
        match answer {
            Some(answer) if desk.is_settled => {
                // Whoever asked may be gone.
                let _ = answer.send(Ok(self.status.describe()));
            }
            Some(answer) => desk.waiting.push(For::Rest, answer),
            None => {}
        }
        Ok((self.status.describe(), desk.next_step))
    }

    /// Takes steps, then pauses; the answer comes after them.
    pub(super) fn step(&self, steps: Steps, answer: Option<Answer>) -> Result<v1::Session, ServiceError> {
        let mut desk = self.lock();
        self.check_room(&mut desk, answer.as_ref())?;
        let session = self.status.describe();
        let coming = desk.coming_step();
        match steps {
            Steps::Until(step) if step <= session.step => {
                if let Some(answer) = answer {
                    // Whoever asked may be gone.
                    let _ = answer.send(Ok(session.clone()));
                }
                return Ok(session);
            }
            Steps::Until(step) if step <= coming => {}
            Steps::More(_) | Steps::Until(_) => {
                let count = match steps {
                    Steps::More(count) => count,
                    Steps::Until(step) => step - coming,
                };
                let is_idle = desk.state == State::Paused;
                self.change(&mut desk, Event::Step(count))?;
                if is_idle {
                    self.set_pace(&mut desk, 0.0);
                }
            }
        }

        if let Some(answer) = answer {
            let what = if desk.state == State::Paused { For::Rest } else { For::Steps };
            desk.waiting.push(what, answer);
        }
        Ok(self.status.describe())
    }

    /// Ends the simulation after the step in progress; the answer comes then.
    pub(super) fn stop(&self, answer: Answer) -> Result<(), ServiceError> {
        let mut desk = self.lock();
        if matches!(desk.state, State::Finished | State::Failed) {
            // Whoever asked may be gone.
            let _ = answer.send(Ok(self.status.describe()));
            return Ok(());
        }

        self.check_room(&mut desk, Some(&answer))?;
        desk.ending = desk.ending.max(Ending::Simulation);
        desk.waiting.push(For::End, answer);
        self.changed.notify_one();
        Ok(())
    }

    /// Takes changes for step `at_step`, or for the first that has not begun; the answer comes when they take effect.
    pub(super) fn update(
        &self,
        at_step: u64,
        changes: Vec<Change>,
        answer: Option<Answer>,
    ) -> Result<Accepted, ServiceError> {
        self.rules.check(&changes).map_err(|error| ServiceError::from(&error))?;

        let mut desk = self.lock();
        self.check_room(&mut desk, answer.as_ref())?;
        self.change(&mut desk, Event::Update)?;
        let latest = desk.next_step.saturating_add(MAX_STEPS_AHEAD);
        if at_step > latest {
            let problem = format!("is {at_step}: allowed is at most {latest}, {MAX_STEPS_AHEAD} steps ahead");
            return Err(ServiceError::field("at_step", problem)
                .with("value", at_step)
                .with("allowed", latest));
        }

        let step = at_step.max(desk.next_step);
        let accepted = desk.pending.push(step, changes)?;
        if let Some(answer) = answer {
            desk.waiting.push(For::Step(step), answer);
        }
        Ok(accepted)
    }

    /// Up to `count` of the changes that wait, after the one given, in the order in which they take effect; and the
    /// last of them if more follow.
    pub(super) fn pending_changes(
        &self,
        after: Option<Accepted>,
        count: usize,
    ) -> (Vec<PendingChange>, Option<Accepted>) {
        self.lock().pending.page(after, count)
    }

    /// Drops changes that wait: those of these orders, or all. Returns how many there were.
    pub(super) fn drop_changes(&self, orders: Option<&[u64]>) -> u64 {
        self.lock().pending.drop_groups(orders)
    }

    /// Asks for the newest frame with everything that watchers want. None if the session is stepping: the next frame
    /// has it.
    pub(super) fn complete_newest(&self) -> Result<Option<oneshot::Receiver<()>>, ServiceError> {
        let mut desk = self.lock();
        if desk.ending == Ending::Thread || desk.in_progress != InProgress::Nothing || is_stepping(desk.state)
        {
            return Ok(None);
        }

        desk.completions.retain(|completion| !completion.is_closed());
        let (done, completed) = oneshot::channel();
        self.check_room(&mut desk, Some(&done))?;
        desk.completions.push(done);
        self.changed.notify_one();
        Ok(Some(completed))
    }

    /// Ends the thread, within the step in progress.
    pub(super) fn delete(&self) {
        self.lock().ending = Ending::Thread;
        self.interrupt.request();
        self.changed.notify_one();
    }

    /// Whether it takes steps, or is asked to.
    pub(super) fn is_stepping(&self) -> bool {
        let desk = self.lock();
        is_stepping(desk.state) || desk.in_progress != InProgress::Nothing
    }

    /// Whether the session is being deleted.
    pub(super) fn is_deleted(&self) -> bool {
        self.lock().ending == Ending::Thread
    }

    /// Gives up the step in progress, after which there is none: for a session that is to stop.
    pub(super) fn interrupt(&self) {
        self.interrupt.request();
    }

    /// Makes what the thread does next panic, as a bug would: for tests of isolation.
    pub(super) fn inject_panic(&self) {
        self.lock().injected = Injected::Panic;
    }

    fn set_pace(&self, desk: &mut Desk, factor: f64) {
        desk.pace = Pace::start(factor, Instant::now(), self.status.progress().time_seconds);
    }

    /// Refuses one more call that waits, if as many do as are allowed.
    fn check_room<T>(
        &self,
        desk: &mut Desk,
        answer: Option<&oneshot::Sender<T>>,
    ) -> Result<(), ServiceError> {
        if answer.is_none() || desk.waiting.has_room(desk.completions.len()) {
            return Ok(());
        }
        let (id, allowed) = (&self.status.properties.id, MAX_WAITING);
        let message = format!("{allowed} calls wait for session '{id}'; allowed: at most {allowed}");
        Err(ServiceError::new(Reason::TooManyCommands, message)
            .with("session_id", id)
            .with("allowed", allowed))
    }

    /// Moves to the state that follows an event, and returns what is to be done on the way.
    pub(super) fn change(&self, desk: &mut Desk, event: Event) -> Result<Effect, ServiceError> {
        let id = &self.status.properties.id;
        let (state, effect) = transition(desk.state, event)
            .map_err(|reason| refused(id, reason, self.status.progress().failure))?;

        if state != desk.state {
            if event == Event::Pause && desk.in_progress == InProgress::Asked {
                desk.in_progress = InProgress::Left;
            }
            desk.state = state;
            desk.is_settled = false;
            // The end is told once the last frame is there.
            if state != State::Finished {
                self.status.update(|progress| {
                    progress.state = state;
                    progress.state_hash = None;
                });
            }
            self.changed.notify_one();
        }
        if effect == Effect::StepsInterrupted {
            desk.waiting.answer(|what| what == For::Steps, &Err(interrupted(id, desk.next_step)));
        }
        Ok(effect)
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Desk> {
        // No code that holds the lock can leave it half changed.
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

pub(super) fn is_stepping(state: State) -> bool {
    matches!(state, State::Playing | State::Stepping { .. })
}
