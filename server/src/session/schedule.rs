//! What a session's thread does next, and what it tells of what it did: the thread's side of the control.

use std::{
    sync::PoisonError,
    time::{Duration, Instant},
};

use nappe_proto::v1;
use nappe_sim::world::Change;
use tokio::sync::oneshot;

use super::{
    control::Control,
    desk::{Copied, Desk, Ending, InProgress, Injected, Rerun, Trial},
    kept::Again,
    pending_changes::{Accepted, Queue},
    taken::Taken,
    transition::{Effect, Event, State},
    waiting::FrameWish,
};
use crate::{
    error::ServiceError,
    state::{Goal, Record, StatePlace},
};

/// Time after which a session looks again whether a watcher that it waits for has taken a frame.
const PATIENCE: Duration = Duration::from_millis(2);

/// What the thread does next.
#[derive(Debug)]
pub(super) enum Task {
    /// Takes a step, after these changes, each group in order.
    Step { changes: Vec<Vec<Change>>, injected: Injected },
    /// Finds the hash of the state at which the session stands, and makes the frames of it that answers have.
    Settle { frames: Vec<FrameWish> },
    /// Copies the session for those who wait for it, with the changes that wait.
    Copy { to: Vec<oneshot::Sender<Copied>>, pending: Queue },
    /// Takes what is to be saved of the session for those who wait for it, with the changes that wait.
    Save { to: Vec<oneshot::Sender<Taken>>, pending: Queue },
    /// Takes a state of the session, which is kept there, with the changes that wait.
    Keep { place: StatePlace, pending: Queue },
    /// Puts the session back to its start, for those who wait for it.
    Reset { done: Vec<(oneshot::Sender<Accepted>, Accepted)> },
    /// Tells whether changes can be made, to those who wait for it.
    Try { trials: Vec<Trial> },
    /// Encodes the newest frame again with everything that watchers want now, for those who wait for it.
    Complete { done: Vec<oneshot::Sender<()>>, injected: Injected },
    /// Fails the session: the ranks that step it have ended.
    LoseRanks,
    /// Ends the simulation; the session stays readable.
    Stop,
    /// Ends the thread.
    End,
}

impl Control {
    /// Waits until there is something to do. The next step ends at simulated time `end_time` (s), and begins only
    /// while frames have `room`.
    pub(super) fn next(&self, end_time: f64, room: impl Fn() -> bool) -> Task {
        let mut desk = self.lock();
        loop {
            if let Some(task) = desk.asked() {
                return task;
            }

            desk.frames.retain(|wish| !wish.done.is_closed());
            if desk.state.is_stepping() {
                // The next frame has what they wait for.
                desk.completions.clear();
                // The state that an answer shows passes with the next step.
                let step = desk.next_step;
                if desk.frames.iter().any(|wish| wish.step == step) {
                    let frames = desk.frames.extract_if(.., |wish| wish.step == step).collect();
                    return Task::Settle { frames };
                }
                self.end_rerun(&mut desk);
                let wait = desk.pace.wait(Instant::now(), end_time);
                let wait = if room() { wait } else { wait.max(PATIENCE) };
                if wait.is_zero() {
                    return self.begin(&mut desk);
                }
                desk = match self.changed.wait_timeout(desk, wait) {
                    Ok((desk, _)) => desk,
                    Err(poisoned) => poisoned.into_inner().0,
                };
                continue;
            }

            if !desk.is_settled || !desk.frames.is_empty() {
                return Task::Settle { frames: std::mem::take(&mut desk.frames) };
            }
            if !desk.completions.is_empty() {
                let done = std::mem::take(&mut desk.completions);
                return Task::Complete { done, injected: std::mem::take(&mut desk.injected) };
            }
            desk = self.changed.wait(desk).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn begin(&self, desk: &mut Desk) -> Task {
        let index = desk.next_step;
        desk.next_step += 1;
        desk.in_progress = InProgress::Asked;
        let changes = desk.pending.take_due(index);

        // Frames of the state that this step leaves are made or given up.
        desk.frames.retain(|wish| wish.step > index);
        // Who waits for changes is told once they are made.
        if changes.is_empty() {
            self.answer_waiting(desk);
        }
        Task::Step { changes, injected: std::mem::take(&mut desk.injected) }
    }

    /// The changes before the step in progress are made.
    pub(super) fn made_changes(&self) {
        self.answer_waiting(&mut self.lock());
    }

    /// A step was taken, perhaps the last that the session allows. What follows from that.
    pub(super) fn stepped(&self, event: Event) -> Effect {
        let mut desk = self.lock();
        let in_progress = std::mem::replace(&mut desk.in_progress, InProgress::Nothing);
        let is_asked = in_progress == InProgress::Asked && desk.state.is_stepping();
        let effect = if event == Event::Stepped && !is_asked {
            Effect::None
        } else {
            self.change(&mut desk, event).expect("a session that stepped may step")
        };
        self.answer_waiting(&mut desk);
        effect
    }

    /// A step was given up, since the session is to stop or was deleted.
    pub(super) fn interrupted(&self) {
        let mut desk = self.lock();
        desk.in_progress = InProgress::Nothing;
        desk.next_step = self.status.progress().step;
        // Changes before that step may be made, or may not: from the last state on, the session comes here again.
        if let Some(keep) = &mut desk.keep {
            keep.end_states();
        }
    }

    /// The session was put back to its start: the hash of its state is another one.
    pub(super) fn has_reset(&self) {
        self.lock().is_settled = false;
        self.status.update(|progress| progress.state_hash = None);
    }

    /// The session stands, at a state with this hash.
    pub(super) fn settled(&self, hash: Option<u64>) {
        let mut desk = self.lock();
        if desk.state.is_stepping() {
            return;
        }
        desk.is_settled = true;
        let step = desk.taken();
        desk.note_seen(step);
        self.status.update(|progress| progress.state_hash = hash);
        self.answer_waiting(&mut desk);
    }

    /// Moves on to the end, unless the session has come there; whether it had not.
    pub(super) fn stop_now(&self) -> bool {
        let mut desk = self.lock();
        let effect = self.change(&mut desk, Event::Stop).expect("a session can be stopped in every state");
        self.answer_waiting(&mut desk);
        effect != Effect::None
    }

    /// The simulation came to its end, at a state with this hash.
    pub(super) fn finished(&self, hash: Option<u64>) {
        let mut desk = self.lock();
        let step = desk.taken();
        desk.note(&Record::Goal(Goal::End { step }));
        desk.rerun = Rerun::default();
        desk.is_settled = true;
        self.status.update(|progress| {
            progress.state = State::Finished;
            progress.state_hash = hash;
        });
        self.answer_waiting(&mut desk);
    }

    /// The session failed: `note` writes how, and everybody who waits is told.
    pub(super) fn failed(&self, error: &ServiceError, failure: v1::Failure, hash: Option<u64>) {
        let mut desk = self.lock();
        desk.rerun = Rerun::default();
        desk.state = State::Failed;
        desk.in_progress = InProgress::Nothing;
        desk.is_settled = true;
        self.status.update(|progress| {
            progress.state = State::Failed;
            progress.state_hash = hash;
            progress.failure = Some(failure);
        });
        desk.next_step = self.status.progress().step;
        desk.waiting.fail(error);
        desk.completions.clear();
        desk.copies.clear();
        desk.saves.clear();
        desk.trials.clear();
        desk.frames.clear();
    }

    /// Tells everybody who waits that the session is gone.
    pub(super) fn ended(&self, error: &ServiceError) {
        let mut desk = self.lock();
        desk.ending = Ending::Thread;
        // Their memory is free for others before anybody is told of the end.
        desk.pending.drop_groups(None, None);
        desk.waiting.fail(error);
        desk.completions.clear();
        desk.copies.clear();
        desk.saves.clear();
        desk.trials.clear();
        desk.frames.clear();
    }
}

impl Desk {
    /// What the thread is to do before it looks whether a step is due.
    fn asked(&mut self) -> Option<Task> {
        match self.ending {
            // What somebody may know of is done again before it ends.
            Ending::Simulation if self.is_rerunning() => {}
            Ending::Nothing => {}
            Ending::Simulation => {
                self.ending = Ending::Nothing;
                return Some(Task::Stop);
            }
            Ending::Thread => return Some(Task::End),
        }

        if std::mem::take(&mut self.are_ranks_lost) && !matches!(self.state, State::Finished | State::Failed)
        {
            return Some(Task::LoseRanks);
        }

        let is_rerunning = self.is_rerunning();
        self.copies.retain(|copy| !copy.is_closed());
        if !self.copies.is_empty() && !is_rerunning {
            let to = std::mem::take(&mut self.copies);
            return Some(Task::Copy { to, pending: self.pending.queue().clone() });
        }

        self.saves.retain(|save| !save.is_closed());
        if !self.saves.is_empty() && !is_rerunning {
            let to = std::mem::take(&mut self.saves);
            return Some(Task::Save { to, pending: self.pending.queue().clone() });
        }

        match self.done_again() {
            Some(Again::Reset) => return Some(Task::Reset { done: Vec::new() }),
            Some(Again::End) => return Some(Task::Stop),
            None => {}
        }
        if let Some((place, pending)) = self.state_due() {
            return Some(Task::Keep { place, pending });
        }

        if matches!(self.state, State::Finished | State::Failed) {
            // Who waits is told that the session is at its end.
            self.resets.clear();
        }
        if !self.resets.is_empty() && !self.is_rerunning() {
            let (resets, step) = (std::mem::take(&mut self.resets), self.next_step);
            let count = |done| (done, self.pending.count_call(step));
            let done = resets.into_iter().map(count).collect();
            return Some(Task::Reset { done });
        }

        if !self.trials.is_empty() {
            return Some(Task::Try { trials: std::mem::take(&mut self.trials) });
        }
        None
    }
}
