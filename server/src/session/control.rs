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
    desk::{Copied, Desk, Ending, InProgress, Injected},
    failure::refused,
    pace::Pace,
    pending_changes::PendingChanges,
    status::Status,
    taken::Taken,
    transition::{Effect, Event, State, transition},
    waiting::{Answer, For, FrameWish, MAX_WAITING},
};
use crate::{
    error::{Reason, ServiceError},
    state::{Goal, Record},
    stream::{EncodedFrame, FieldSet},
};

/// How a session is controlled.
#[derive(Debug)]
pub(super) struct Control {
    pub(super) status: Arc<Status>,
    pub(super) rules: Arc<ChangeRules>,
    pub(super) interrupt: Interrupt,
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
        let mut desk = self.open()?;
        self.change(&mut desk, Event::Play)?;
        self.set_pace(&mut desk, real_time_factor);
        desk.note(&Record::Goal(Goal::Play { factor: real_time_factor }));
        self.answer_waiting(&mut desk);
        Ok(self.status.describe())
    }

    /// Pauses after the step in progress. Returns the session as of now, and the steps that it will have taken; the
    /// answer comes once it stands there.
    pub(super) fn pause(&self, answer: Option<Answer>) -> Result<(v1::Session, u64), ServiceError> {
        let mut desk = self.open()?;
        self.check_room(&mut desk, answer.as_ref())?;
        self.change(&mut desk, Event::Pause)?;
        if desk.state == State::Paused && desk.rerun.end.is_none() {
            let (step, left) = (desk.open_step(), desk.open_step() - desk.next_step);
            if left > 0 {
                // Steps that somebody has seen are taken again before it stands.
                self.change(&mut desk, Event::Step(left))?;
            }
            desk.note(&Record::Goal(Goal::Stand { step }));
        }
        if let Some(answer) = answer {
            desk.waiting.push(For::Rest, answer);
        }
        self.answer_waiting(&mut desk);
        Ok((self.status.describe(), desk.open_step()))
    }

    /// Makes changes and takes steps, then pauses; the answer comes after them.
    pub(super) fn step(&self, order: StepOrder, answer: Option<Answer>) -> Result<v1::Session, ServiceError> {
        let StepOrder { steps, changes, frame } = order;
        self.rules.check(&changes).map_err(|error| ServiceError::from(&error))?;

        let mut desk = self.open()?;
        self.check_room(&mut desk, answer.as_ref())?;
        let coming = desk.coming_step();
        let target = match steps {
            Steps::Until(step) => step,
            Steps::More(count) => coming.saturating_add(count),
        };
        let count = target.saturating_sub(coming);
        if count > 0 {
            let is_idle = desk.state == State::Paused;
            self.check_change(&desk, Event::Step(count))?;
            if !changes.is_empty() {
                let next = desk.open_step();
                self.check_speeds(&desk, next, &changes)?;
                desk.push(next, changes)?;
            }
            self.change(&mut desk, Event::Step(count))?;
            let step = desk.coming_step();
            desk.note(&Record::Goal(Goal::Stand { step }));
            if is_idle {
                self.set_pace(&mut desk, 0.0);
            }
        }

        let target = self.within_limit(&desk, target);
        if let Some((fields, done)) = frame {
            self.show(&mut desk, target, fields, done);
        }
        if let Some(answer) = answer {
            desk.waiting.push(For::Steps(target), answer);
        }
        self.answer_waiting(&mut desk);
        Ok(self.status.describe())
    }

    /// Steps after which a session stands that was asked to step until `target`: it may come to its end before.
    fn within_limit(&self, desk: &Desk, target: u64) -> u64 {
        match self.status.properties.step_limit {
            0 => target,
            limit => target.min(limit.max(desk.taken().saturating_add(1))),
        }
    }

    /// Has the frame made of the state after `target` steps, or of the present state if they were taken; of none if
    /// a step away from that is in progress.
    fn show(&self, desk: &mut Desk, target: u64, fields: FieldSet, done: oneshot::Sender<Arc<EncodedFrame>>) {
        let taken = desk.taken();
        let passes = target <= taken && desk.in_progress != InProgress::Nothing;
        if !passes && desk.state != State::Failed {
            desk.frames.push(FrameWish { fields, step: target.max(taken), done });
            self.changed.notify_one();
        }
    }

    /// Ends the simulation after the step in progress; the answer comes then.
    pub(super) fn stop(&self, answer: Answer) -> Result<(), ServiceError> {
        let mut desk = self.open()?;
        self.check_room(&mut desk, Some(&answer))?;
        if !matches!(desk.state, State::Finished | State::Failed) {
            desk.ending = desk.ending.max(Ending::Simulation);
            self.changed.notify_one();
        }
        desk.waiting.push(For::End, answer);
        self.answer_waiting(&mut desk);
        Ok(())
    }

    /// Asks for a copy, between two steps.
    pub(super) fn copy(&self) -> Result<oneshot::Receiver<Copied>, ServiceError> {
        self.ask_of_state(|desk| &mut desk.copies)
    }

    /// Asks for what is to be saved, between two steps.
    pub(super) fn save(&self) -> Result<oneshot::Receiver<Taken>, ServiceError> {
        self.ask_of_state(|desk| &mut desk.saves)
    }

    /// Asks for something of a state that did not fail, by the list of those who wait for it.
    fn ask_of_state<T>(
        &self,
        list: fn(&mut Desk) -> &mut Vec<oneshot::Sender<T>>,
    ) -> Result<oneshot::Receiver<T>, ServiceError> {
        let mut desk = self.open()?;
        if desk.state == State::Failed {
            let failure = self.status.progress().failure;
            return Err(refused(&self.status.properties.id, Reason::SessionFailed, failure));
        }
        let (asked, taken) = oneshot::channel();
        self.check_room(&mut desk, Some(&asked))?;
        list(&mut desk).push(asked);
        self.changed.notify_one();
        Ok(taken)
    }

    /// Asks for the newest frame with everything that watchers want. None if the session is stepping: the next frame
    /// has it.
    pub(super) fn complete_newest(&self) -> Result<Option<oneshot::Receiver<()>>, ServiceError> {
        let mut desk = self.lock();
        let is_stepping = desk.in_progress != InProgress::Nothing || desk.state.is_stepping();
        if desk.ending == Ending::Thread || is_stepping {
            return Ok(None);
        }

        desk.completions.retain(|completion| !completion.is_closed());
        let (done, completed) = oneshot::channel();
        self.check_room(&mut desk, Some(&done))?;
        desk.completions.push(done);
        self.changed.notify_one();
        Ok(Some(completed))
    }

    /// Ends the thread, within the step in progress; what is kept of the session goes with it.
    pub(super) fn delete(&self) {
        if let Some(keep) = &mut self.lock().keep {
            keep.forget();
        }
        self.leave();
        self.interrupt.request();
    }

    /// Ends the thread after the step in progress: the session stays where it is kept.
    pub(super) fn leave(&self) {
        self.lock().ending = Ending::Thread;
        self.changed.notify_one();
    }

    /// Whether it takes steps, or is asked to.
    pub(super) fn is_stepping(&self) -> bool {
        let desk = self.lock();
        desk.state.is_stepping() || desk.in_progress != InProgress::Nothing
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

    /// The pace of the steps from now on.
    pub(super) fn set_pace(&self, desk: &mut Desk, factor: f64) {
        desk.rerun.factor = None;
        desk.pace = Pace::start(factor, Instant::now(), self.status.progress().time_seconds);
    }

    /// Refuses one more call that waits, if as many do as are allowed.
    pub(super) fn check_room<T>(
        &self,
        desk: &mut Desk,
        answer: Option<&oneshot::Sender<T>>,
    ) -> Result<(), ServiceError> {
        let others = desk.others_waiting();
        if answer.is_none() || desk.waiting.has_room(others) {
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
        let next = match event {
            // It had ended before, and comes there again.
            Event::Play | Event::Step(_) | Event::Update if desk.rerun.end.is_some() => {
                Err(Reason::SessionFinished)
            }
            Event::Pause if desk.rerun.end.is_some() => Ok((desk.state, Effect::None)),
            _ => transition(desk.state, event),
        };
        next.map_err(|reason| refused(&self.status.properties.id, reason, self.status.progress().failure))
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
        Ok(effect)
    }

    /// Answers the calls whose time has come: after whatever may have brought it.
    pub(super) fn answer_waiting(&self, desk: &mut Desk) {
        let now = desk.standing();
        if desk.waiting.is_due(now) {
            desk.note_seen(now.begun);
        }
        desk.waiting.answer(now, || self.status.describe());
    }

    /// The desk for a call, unless the session is being deleted: nobody would answer the call.
    pub(super) fn open(&self) -> Result<MutexGuard<'_, Desk>, ServiceError> {
        let desk = self.lock();
        if desk.ending == Ending::Thread {
            return Err(ServiceError::session_deleted(&self.status.properties.id));
        }
        Ok(desk)
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Desk> {
        // No code that holds the lock can leave it half changed.
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
