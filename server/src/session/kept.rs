//! How a session is kept: what its thread, and the thread that writes, tell each other across the desk.

use std::{
    fs::File,
    io,
    time::{Duration, Instant},
};

use nappe_proto::v1;
use prost::Message as _;
use tokio::sync::oneshot;

use super::{
    control::Control,
    desk::{Desk, Ending},
    keep::Keep,
    pending_changes::Queue,
    taken::Taken,
    transition::Event,
};
use crate::{
    memory::Claim,
    state::{Goal, Record, Replay, StatePlace},
};

/// Where a state goes that is due, and the changes that wait.
pub(super) type Due = (StatePlace, Queue);

impl Control {
    /// Tells the log, if there is one.
    pub(super) fn note(&self, record: &Record<'_>) {
        self.lock().note(record);
    }

    /// Keeps the session from now on: a state is taken at once. The receiver hears of its end once that is written, or could not be.
    pub(super) fn begin_keeping(&self, mut keep: Keep) -> oneshot::Receiver<()> {
        let (told, written) = oneshot::channel();
        keep.ask(Some(told));
        self.lock().keep = Some(keep);
        self.changed.notify_one();
        written
    }

    /// Keeps a session that goes on from what is kept of it, before its thread runs: it does again what it had done.
    pub(super) fn go_on(&self, mut keep: Keep, replay: &Replay) {
        let mut desk = self.lock();
        keep.found_state(desk.next_step);
        if let Err(error) = keep.begin_log(desk.next_step) {
            keep.not_kept(&format!("no log can be begun: {error}"));
        }
        if let Some(failure) = &replay.failure {
            keep.note(&Record::Failed(failure.encode_to_vec()));
        }
        let until = replay.resets.iter().copied().fold(replay.seen, u64::max);
        keep.note_seen(until);
        desk.keep = Some(keep);
        desk.rerun.until = until;
        desk.rerun.resets = replay.resets.iter().copied().collect();
        let (target, end) = match replay.goal {
            Some(Goal::Play { factor }) => {
                desk.rerun.factor = Some(factor);
                (until, None)
            }
            Some(Goal::Stand { step }) => (until.max(step), None),
            Some(Goal::End { step }) => (step, Some(step)),
            None => (until, None),
        };
        let event = match (replay.goal, target.saturating_sub(desk.next_step)) {
            (Some(Goal::Play { .. }), _) => Some(Event::Play),
            (_, 0) => None,
            (_, left) => Some(Event::Step(left)),
        };
        if let Some(event) = event {
            self.change(&mut desk, event).expect("a session that is paused may step");
        }
        // From here on it answers calls as one that has ended.
        desk.rerun.end = end;
    }

    /// Whether the session is kept in a folder.
    pub(super) fn is_kept(&self) -> bool {
        self.lock().keep.is_some()
    }

    /// How far what is kept of the session is behind it; none if it is not kept.
    pub(super) fn durability(&self) -> Option<v1::Durability> {
        self.lock().keep.as_ref().map(|keep| keep.durability(Instant::now()))
    }

    /// Asks for a state if one is due: every `interval` if something happened.
    pub(super) fn ask_if_due(&self, interval: Duration) {
        let mut desk = self.lock();
        let (taken, is_busy) = (desk.taken(), desk.is_rerunning());
        let keep = desk.keep.as_mut().filter(|_| !is_busy);
        if keep.is_some_and(|keep| keep.ask_if_due(Instant::now(), taken, interval)) {
            self.changed.notify_one();
        }
    }

    /// A state was taken, at a cost.
    pub(super) fn write_state(&self, place: StatePlace, taken: Taken, memory: Claim, cost: Duration) {
        if let Some(keep) = &mut self.lock().keep {
            keep.write(place, taken, memory, cost);
        }
    }

    /// What came of a state: how many bytes were written, or what was in the way.
    pub(super) fn state_written(&self, written: Result<u64, String>) {
        let id = &self.status.properties.id;
        match (&mut self.lock().keep, written) {
            (Some(keep), Ok(bytes)) => {
                if keep.kept(bytes) {
                    tracing::info!(session = id, "kept again");
                }
            }
            (Some(keep), Err(problem)) => keep.not_kept(&problem),
            (None, Ok(_)) => {}
            // The session has ended meanwhile.
            (None, Err(problem)) => tracing::warn!(session = id, "its last state is not kept: {problem}"),
        }
    }

    /// No state can be taken any more: it may be half changed.
    pub(super) fn end_states(&self) {
        if let Some(keep) = &mut self.lock().keep {
            keep.end_states();
        }
    }

    /// The logs that are to be written through to the disk, in order.
    pub(super) fn unsynced_logs(&self) -> Vec<File> {
        self.lock().keep.as_mut().map_or_else(Vec::new, Keep::unsynced_logs)
    }

    /// A log was not written through to the disk.
    pub(super) fn not_synced(&self, error: &io::Error) {
        if let Some(keep) = &mut self.lock().keep {
            keep.not_synced(error);
        }
    }

    /// Whether it still does again what was done before.
    pub(super) fn is_rerunning(&self) -> bool {
        self.lock().is_rerunning()
    }

    /// Takes what keeps the session, which ends: and a last state, where one is due, with the changes that wait.
    pub(super) fn end_keeping(&self) -> Option<(Keep, Option<Due>)> {
        let mut desk = self.lock();
        desk.ending = Ending::Thread;
        let mut keep = desk.keep.take()?;
        let step = desk.taken();
        let is_due = !keep.is_forgotten() && !desk.is_rerunning() && keep.has_news(step);
        if !is_due {
            return Some((keep, None));
        }
        keep.ask(None);
        let place = keep.begin_state(step);
        let pending = desk.pending.queue().clone();
        Some((keep, place.map(|place| (place, pending))))
    }

    /// Steps that were seen before are taken: the session plays at its pace from here.
    pub(super) fn end_rerun(&self, desk: &mut Desk) {
        if desk.next_step >= desk.rerun.until
            && let Some(factor) = desk.rerun.factor.take()
        {
            self.set_pace(desk, factor);
        }
    }
}

impl Desk {
    /// What is to be done again between two steps, where a session goes on from a state.
    pub(super) fn done_again(&mut self) -> Option<Again> {
        let step = self.next_step;
        if self.rerun.resets.pop_front_if(|reset| *reset <= step).is_some() {
            return Some(Again::Reset);
        }
        self.rerun.end.take_if(|end| *end <= step).map(|_| Again::End)
    }

    /// Where the state goes that is due, if one is, with the changes that wait.
    pub(super) fn state_due(&mut self) -> Option<Due> {
        if self.is_rerunning() {
            return None;
        }
        let step = self.taken();
        let place = self.keep.as_mut()?.begin_state(step)?;
        Some((place, self.pending.queue().clone()))
    }
}

/// What a session does again between two steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Again {
    Reset,
    End,
}
