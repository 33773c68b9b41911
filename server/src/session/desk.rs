//! What the calls of a session and the thread that steps it share.

use std::{borrow::Cow, collections::VecDeque, time::Instant};

use nappe_sim::{
    interrupt::Interrupt,
    world::{Change, Simulation},
};
use tokio::sync::oneshot;

use super::{
    keep::Keep,
    pace::Pace,
    pending_changes::{Accepted, PendingChanges, Queue},
    status::Progress,
    taken::Taken,
    transition::State,
    waiting::{FrameWish, Standing, Waiting},
};
use crate::{error::ServiceError, state::Record};

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
    /// Who waits for a copy of the session.
    pub(super) copies: Vec<oneshot::Sender<Copied>>,
    /// Who waits for what is to be saved of the session.
    pub(super) saves: Vec<oneshot::Sender<Taken>>,
    /// Who waits to be told whether changes can be made.
    pub(super) trials: Vec<Trial>,
    /// Who waits for the session to be put back to its start.
    pub(super) resets: Vec<oneshot::Sender<Accepted>>,
    /// Who waits for a frame of the state after his steps.
    pub(super) frames: Vec<FrameWish>,
    pub(super) ending: Ending,
    /// Whether the session stands, the hash of its state is known, and an end has been told.
    pub(super) is_settled: bool,
    pub(super) injected: Injected,
    /// Whether the ranks that step it have ended by themselves.
    pub(super) are_ranks_lost: bool,
    /// What keeps it in a folder, if something does.
    pub(super) keep: Option<Keep>,
    pub(super) rerun: Rerun,
}

/// What a session that goes on from a state has to do again, before anything else.
#[derive(Debug, Default)]
pub(super) struct Rerun {
    /// After how many steps it goes back to its start, in order.
    pub(super) resets: VecDeque<u64>,
    /// Steps of which somebody may know: calls change what comes after them.
    pub(super) until: u64,
    /// The pace after them, if it plays then.
    pub(super) factor: Option<f64>,
    /// After how many steps it ended.
    pub(super) end: Option<u64>,
}

impl Desk {
    /// Of a session that stands, paused.
    pub(super) fn new(progress: &Progress, pending: PendingChanges) -> Self {
        Self {
            state: State::Paused,
            pace: Pace::start(0.0, Instant::now(), progress.time_seconds),
            next_step: progress.step,
            in_progress: InProgress::Nothing,
            pending,
            waiting: Waiting::default(),
            completions: Vec::new(),
            copies: Vec::new(),
            saves: Vec::new(),
            trials: Vec::new(),
            resets: Vec::new(),
            frames: Vec::new(),
            ending: Ending::Nothing,
            is_settled: true,
            injected: Injected::Nothing,
            are_ranks_lost: false,
            keep: None,
            rerun: Rerun::default(),
        }
    }

    /// Steps that were taken.
    pub(super) fn taken(&self) -> u64 {
        self.next_step - u64::from(self.in_progress != InProgress::Nothing)
    }

    /// The first step that calls can change.
    pub(super) fn open_step(&self) -> u64 {
        self.next_step.max(self.rerun.until)
    }

    /// Whether it still does again what was done before.
    pub(super) fn is_rerunning(&self) -> bool {
        let Rerun { resets, until, end, .. } = &self.rerun;
        self.next_step < *until || !resets.is_empty() || end.is_some()
    }

    /// The last place among changes that were made before the session went on from a state, and are made again: they wait no longer.
    pub(super) fn last_made(&self) -> Option<Accepted> {
        self.rerun.until.checked_sub(1).map(|step| Accepted { step, order: u64::MAX })
    }

    /// Takes changes for a step; the log has them before anybody is told, and that those of later calls come no earlier.
    pub(super) fn push(&mut self, step: u64, changes: Vec<Change>) -> Result<Accepted, ServiceError> {
        let (accepted, open) = (self.pending.push(step, changes)?, self.open_step());
        if let Some(keep) = &mut self.keep
            && let Some(changes) = self.pending.queue().group(accepted)
        {
            keep.note_seen(open);
            let Accepted { step, order } = accepted;
            keep.note(&Record::Changes { step, order, changes: Cow::Borrowed(changes) });
        }
        Ok(accepted)
    }

    /// Tells the log, if there is one.
    pub(super) fn note(&mut self, record: &Record<'_>) {
        if let Some(keep) = &mut self.keep {
            keep.note(record);
        }
    }

    /// Tells the log, if there is one, that somebody may know of so many steps.
    pub(super) fn note_seen(&mut self, step: u64) {
        if let Some(keep) = &mut self.keep {
            keep.note_seen(step);
        }
    }

    /// How the session stands, as far as calls wait for it.
    pub(super) fn standing(&self) -> Standing {
        Standing {
            state: self.state,
            taken: self.taken(),
            begun: self.next_step,
            is_settled: self.is_settled,
        }
    }

    /// Calls that wait for something else than those in `waiting`.
    pub(super) fn others_waiting(&self) -> usize {
        let asked = self.completions.len() + self.copies.len() + self.saves.len();
        asked + self.trials.len() + self.resets.len()
    }

    /// Steps that will have been taken once the session stands, if nobody asks for more.
    pub(super) fn coming_step(&self) -> u64 {
        let begun = u64::from(self.in_progress == InProgress::Asked);
        match self.state {
            State::Stepping { remaining } => self.next_step.saturating_add(remaining - begun),
            _ => self.next_step,
        }
    }
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

/// Changes before the next step, and where it is told whether they can be made.
#[derive(Debug)]
pub(super) struct Trial {
    pub(super) changes: Vec<Change>,
    /// Given up with the session, and where the caller goes.
    pub(super) interrupt: Interrupt,
    pub(super) done: oneshot::Sender<Result<(), ServiceError>>,
}

/// A session as it stands between two steps.
#[derive(Debug)]
pub(super) struct Copied {
    pub(super) simulation: Simulation,
    /// The changes that wait.
    pub(super) pending: Queue,
}
