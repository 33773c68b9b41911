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
    desk::{Copied, Desk, Ending, InProgress, Injected, is_stepping},
    failure::{interrupted, refused},
    pace::Pace,
    pending_changes::{Accepted, PendingChange, PendingChanges},
    status::Status,
    transition::{Effect, Event, State, transition},
    waiting::{Answer, For, FrameWish, MAX_WAITING},
};
use crate::{
    error::{Reason, ServiceError},
    stream::{EncodedFrame, FieldSet},
};

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

/// Which steps a call asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Steps {
    /// So many more, 1 or more.
    More(u64),
    /// Until so many were taken since the start; none if they were.
    Until(u64),
}

/// Steps, what comes before them, and what is told after them.
#[derive(Debug)]
pub(super) struct StepOrder {
    pub steps: Steps,
    /// Changes before the first step, all or none; none if the steps were asked for by another call.
    pub changes: Vec<Change>,
    /// Fields of the state after the steps, and where a frame with them goes.
    pub frame: Option<(FieldSet, oneshot::Sender<Arc<EncodedFrame>>)>,
}

impl Control {
    /// Of a session that stands, paused.
    pub(super) fn new(
        status: Arc<Status>,
        rules: Arc<ChangeRules>,
        interrupt: Interrupt,
        pending: PendingChanges,
    ) -> Self {
        let progress = status.progress();
        let desk = Desk::new(&progress, pending);
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

    /// Makes changes and takes steps, then pauses; the answer comes after them.
    pub(super) fn step(&self, order: StepOrder, answer: Option<Answer>) -> Result<v1::Session, ServiceError> {
        let StepOrder { steps, changes, frame } = order;
        self.rules.check(&changes).map_err(|error| ServiceError::from(&error))?;

        let mut desk = self.lock();
        self.check_room(&mut desk, answer.as_ref())?;
        let session = self.status.describe();
        let coming = desk.coming_step();
        let count = match steps {
            Steps::Until(step) if step <= session.step => return Ok(self.stand(&mut desk, frame, answer)),
            Steps::Until(step) => step.saturating_sub(coming),
            Steps::More(count) => count,
        };
        if count > 0 {
            let is_idle = desk.state == State::Paused;
            self.check_change(&desk, Event::Step(count))?;
            if !changes.is_empty() {
                let next = desk.next_step;
                desk.pending.push(next, changes)?;
            }
            self.change(&mut desk, Event::Step(count))?;
            if is_idle {
                self.set_pace(&mut desk, 0.0);
            }
        }

        if let Some((fields, done)) = frame {
            let step = desk.coming_step();
            desk.frames.push(FrameWish { fields, step, done });
        }
        if let Some(answer) = answer {
            let what = if desk.state == State::Paused { For::Rest } else { For::Steps };
            desk.waiting.push(what, answer);
        }
        Ok(self.status.describe())
    }

    /// Answers a call whose steps were taken before; a frame is made only if the session stands.
    fn stand(
        &self,
        desk: &mut Desk,
        frame: Option<(FieldSet, oneshot::Sender<Arc<EncodedFrame>>)>,
        answer: Option<Answer>,
    ) -> v1::Session {
        let session = self.status.describe();
        let stands =
            matches!(desk.state, State::Paused | State::Finished) && desk.in_progress == InProgress::Nothing;
        match (answer, frame) {
            (Some(answer), Some((fields, done))) if stands => {
                desk.frames.push(FrameWish { fields, step: session.step, done });
                desk.waiting.push(For::Rest, answer);
                desk.is_settled = false;
                self.changed.notify_one();
            }
            // Whoever asked may be gone.
            (Some(answer), _) => drop(answer.send(Ok(session.clone()))),
            (None, _) => {}
        }
        session
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

    /// Asks for a copy, between two steps.
    pub(super) fn copy(&self) -> Result<oneshot::Receiver<Copied>, ServiceError> {
        let mut desk = self.lock();
        if desk.state == State::Failed {
            let failure = self.status.progress().failure;
            return Err(refused(&self.status.properties.id, Reason::SessionFailed, failure));
        }
        let (copy, copied) = oneshot::channel();
        self.check_room(&mut desk, Some(&copy))?;
        desk.copies.push(copy);
        self.changed.notify_one();
        Ok(copied)
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

    /// The ranks that step the session have ended by themselves.
    pub(super) fn lose_ranks(&self) {
        self.lock().are_ranks_lost = true;
        self.changed.notify_one();
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
        if answer.is_none() || desk.waiting.has_room(desk.completions.len() + desk.copies.len()) {
            return Ok(());
        }
        let (id, allowed) = (&self.status.properties.id, MAX_WAITING);
        let message = format!("{allowed} calls wait for session '{id}'; allowed: at most {allowed}");
        Err(ServiceError::new(Reason::TooManyCommands, message)
            .with("session_id", id)
            .with("allowed", allowed))
    }

    /// The state that follows an event, and what is to be done on the way; why there is none.
    fn check_change(&self, desk: &Desk, event: Event) -> Result<(State, Effect), ServiceError> {
        transition(desk.state, event)
            .map_err(|reason| refused(&self.status.properties.id, reason, self.status.progress().failure))
    }

    /// Moves to the state that follows an event, and returns what is to be done on the way.
    pub(super) fn change(&self, desk: &mut Desk, event: Event) -> Result<Effect, ServiceError> {
        let (state, effect) = self.check_change(desk, event)?;

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
            let cut_short = Err(interrupted(&self.status.properties.id, desk.next_step));
            desk.waiting.answer(|what| what == For::Steps, &cut_short);
        }
        Ok(effect)
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Desk> {
        // No code that holds the lock can leave it half changed.
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
