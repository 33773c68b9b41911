//! What a session keeps of itself in a folder: its log, and when the next state of it is due.
//!
//! Enters: records, of which the log has each before this returns; the time. Leaves: whether a state is due, and where it goes. A log
//! that cannot be written is told of, and stops nobody: the next state makes it superfluous.

use std::{
    fs::File,
    io::{self, Write as _},
    sync::mpsc::Sender,
    thread::JoinHandle,
    time::{Duration, Instant},
};

use nappe_proto::v1;
use tokio::sync::oneshot;

use super::taken::Taken;
use crate::{
    memory::Claim,
    state::{Goal, Record, SessionFolder, StatePlace, encode},
};

/// After how long it is tried again to keep a session that could not be kept.
const RETRY: Duration = Duration::from_secs(10);
/// Seconds between two states for each second that taking one costs the stepping: 2 % of it at most.
const COST_SHARE: u32 = 50;
/// A log that is longer than the last state, and than this (bytes), brings the next state forward.
const LONG_LOG: u64 = 1 << 20;

/// What the thread that writes is asked to do.
#[derive(Debug)]
pub(super) enum Order {
    /// Writes a state there, whose memory is claimed; who waits is told when that is dropped.
    Write { place: StatePlace, taken: Box<Taken>, memory: Claim, waiting: Vec<oneshot::Sender<()>> },
    /// Removes all that is kept, and ends.
    Remove,
    /// Ends, and removes nothing.
    End,
}

/// Whether a state is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Waits,
    /// The thread that steps is to take one.
    Asked,
    /// One is taken and written.
    Writes,
    /// The state may be half changed, and is not looked at again.
    Over,
}

/// What keeps a session.
#[derive(Debug)]
pub(super) struct Keep {
    folder: SessionFolder,
    /// To the thread that writes.
    orders: Sender<Order>,
    writer: JoinHandle<()>,
    log: Option<File>,
    /// Bytes of the log, and how many of them it began with.
    logged: [u64; 2],
    is_unsynced: bool,
    /// Whether records are missing since the last state.
    has_gap: bool,
    /// Logs before this one of which the end is not on the disk yet, the oldest first.
    unsynced: Vec<File>,
    /// Where the log stands.
    place: StatePlace,
    /// Steps of which the log, or a state, says that somebody may know.
    seen: u64,
    goal: Goal,
    failure: Option<Vec<u8>>,
    stage: Stage,
    /// When a state was taken last, and what that cost.
    taken_at: Instant,
    cost: Duration,
    /// Bytes of the last state.
    state_bytes: u64,
    /// Steps at the newest state that is there, and when that was taken.
    written: Option<(u64, Instant)>,
    /// Why it is not kept at the moment.
    problem: Option<String>,
    /// Who waits for the first state.
    waiting: Vec<oneshot::Sender<()>>,
    is_forgotten: bool,
}

impl Keep {
    /// Of a session that has to do what `goal` says, after what stands at `place`; what writes is started.
    pub(super) fn new(
        folder: SessionFolder,
        (orders, writer): (Sender<Order>, JoinHandle<()>),
        place: StatePlace,
        goal: Goal,
    ) -> Self {
        Self {
            folder,
            orders,
            writer,
            log: None,
            logged: [0; 2],
            is_unsynced: false,
            has_gap: false,
            unsynced: Vec::new(),
            place,
            seen: place.step,
            goal,
            failure: None,
            stage: Stage::Waits,
            taken_at: Instant::now(),
            cost: Duration::ZERO,
            state_bytes: 0,
            written: None,
            problem: None,
            waiting: Vec::new(),
            is_forgotten: false,
        }
    }

    /// A state is there after so many steps, of which the session goes on.
    pub(super) fn found_state(&mut self, step: u64) {
        self.written = Some((step, self.taken_at));
    }

    /// How far what is kept is behind the session.
    pub(super) fn durability(&self, now: Instant) -> v1::Durability {
        v1::Durability {
            step: self.written.map(|(step, _)| step),
            age_seconds: self.written.map(|(_, at)| now.saturating_duration_since(at).as_secs_f64()),
            problem: self.problem.clone().unwrap_or_default(),
        }
    }

    /// Tells the log.
    pub(super) fn note(&mut self, record: &Record<'_>) {
        match record {
            Record::Goal(goal) => self.goal = *goal,
            Record::Failed(failure) => self.failure = Some(failure.clone()),
            Record::Frame { step, .. } | Record::Seen { step } => self.seen = self.seen.max(*step),
            _ => {}
        }
        if let Err(error) = self.append(record) {
            self.fail(&format!("the log cannot be written: {error}"));
        }
    }

    /// Tells the log that somebody may know of so many steps, unless it says so.
    pub(super) fn note_seen(&mut self, step: u64) {
        if step > self.seen {
            self.note(&Record::Seen { step });
        }
    }

    /// Appends to the log, if there is one; where that fails, there is none any more.
    fn append(&mut self, record: &Record<'_>) -> io::Result<()> {
        let Some(log) = &mut self.log else {
            self.has_gap = true;
            return Ok(());
        };
        let bytes = encode(record).map_err(io::Error::other);
        let written = bytes.and_then(|bytes| log.write_all(&bytes).map(|()| bytes.len() as u64));
        match written {
            Ok(count) => {
                self.logged[0] += count;
                self.is_unsynced = true;
                Ok(())
            }
            Err(error) => {
                // What was written of it is no record.
                let _ = log.set_len(self.logged[0]);
                (self.log, self.has_gap) = (None, true);
                Err(error)
            }
        }
    }

    /// Begins a new log after so many steps, which says first what the session is to do. A state with the same place may be taken.
    pub(super) fn begin_log(&mut self, step: u64) -> io::Result<StatePlace> {
        let place = StatePlace { number: self.place.number + 1, step };
        // Where its file cannot be made, the next one has another name.
        self.place.number = place.number;
        // It may be gone with the rest.
        self.folder.make()?;
        let log = self.folder.new_log(place)?;
        self.place = place;
        // What follows is worth nothing without what was before.
        self.unsynced.extend(self.log.take().filter(|_| self.is_unsynced));
        (self.log, self.logged) = (Some(log), [0; 2]);
        if self.has_gap {
            self.append(&Record::Gap)?;
            self.has_gap = false;
        }
        self.append(&Record::Goal(self.goal))?;
        if let Some(failure) = self.failure.clone() {
            self.append(&Record::Failed(failure))?;
        }
        self.logged[1] = self.logged[0];
        Ok(place)
    }

    /// Asks for a state, whoever waits for it.
    pub(super) fn ask(&mut self, waiting: Option<oneshot::Sender<()>>) {
        self.waiting.extend(waiting);
        self.stage = Stage::Asked;
    }

    /// Asks for a state if one is due, of a session that has taken so many steps: every `interval` if something happened.
    pub(super) fn ask_if_due(&mut self, now: Instant, taken: u64, interval: Duration) -> bool {
        if self.stage != Stage::Waits {
            return false;
        }
        let least = self.cost.saturating_mul(COST_SHARE);
        let is_long = self.logged[0] > self.state_bytes.max(LONG_LOG);
        let wait = match self.problem {
            Some(_) => RETRY.max(least),
            None if is_long => least,
            None => interval.max(least),
        };
        let is_due = self.has_news(taken) && now.saturating_duration_since(self.taken_at) >= wait;
        if is_due {
            self.stage = Stage::Asked;
        }
        is_due
    }

    /// Whether a session that has taken so many steps has done or was told something since the last state, and one can be taken.
    pub(super) fn has_news(&self, taken: u64) -> bool {
        let [logged, begun] = self.logged;
        let is_behind = self.problem.is_some() || self.has_gap;
        let is_old = is_behind || taken != self.place.step || logged > begun;
        is_old && self.stage != Stage::Over
    }

    /// Begins to take a state that was asked for, after so many steps: where it goes; none if none was, or its log cannot be made.
    pub(super) fn begin_state(&mut self, step: u64) -> Option<StatePlace> {
        if self.stage != Stage::Asked {
            return None;
        }
        self.taken_at = Instant::now();
        match self.begin_log(step) {
            Ok(place) => {
                self.stage = Stage::Writes;
                Some(place)
            }
            Err(error) => {
                self.not_kept(&format!("no log can be begun: {error}"));
                None
            }
        }
    }

    /// The state that was to be taken at `place` was taken, at a cost.
    pub(super) fn write(&mut self, place: StatePlace, taken: Taken, memory: Claim, cost: Duration) {
        self.cost = cost;
        let waiting = std::mem::take(&mut self.waiting);
        let order = Order::Write { place, taken: Box::new(taken), memory, waiting };
        if self.orders.send(order).is_err() {
            self.not_kept("the thread that writes has ended");
        }
    }

    /// A state of so many bytes was written. Whether the session was not kept before.
    pub(super) fn kept(&mut self, bytes: u64) -> bool {
        self.state_bytes = bytes;
        // No log is begun while a state is written.
        self.found_state(self.place.step);
        self.settle();
        // A log that broke meanwhile is a problem still.
        self.log.is_some() && self.problem.take().is_some()
    }

    /// A state was not written, or not taken: it is tried again.
    pub(super) fn not_kept(&mut self, problem: &str) {
        self.settle();
        self.fail(problem);
        let is_alone = || self.folder.states().is_ok_and(|states| states.is_empty());
        if self.written.is_none() && self.log.is_some() && is_alone() {
            // Nobody can go on from a log alone, which would grow.
            (self.log, self.has_gap) = (None, true);
            // What stays of it goes with the session.
            let _ = self.folder.remove_log(self.place);
        }
    }

    /// No state can be taken any more.
    pub(super) fn end_states(&mut self) {
        self.settle();
        self.stage = Stage::Over;
    }

    /// Nobody waits for a state any more, and none is written.
    fn settle(&mut self) {
        self.waiting.clear();
        if self.stage != Stage::Over {
            self.stage = Stage::Waits;
        }
    }

    /// It is not kept at the moment, which is told once.
    fn fail(&mut self, problem: &str) {
        if self.problem.is_none() {
            let (folder, seconds) = (self.folder.path().display(), RETRY.as_secs());
            tracing::warn!("{folder} is behind: {problem}; it is tried again every {seconds} s");
        }
        self.problem = Some(problem.to_owned());
    }

    /// The logs to which something was written since this was asked last, the oldest first.
    pub(super) fn unsynced_logs(&mut self) -> Vec<File> {
        let mut logs = std::mem::take(&mut self.unsynced);
        if std::mem::take(&mut self.is_unsynced) {
            logs.extend(self.log.as_ref().and_then(|log| log.try_clone().ok()));
        }
        logs
    }

    /// A log was not written through to the disk: the next state makes it superfluous.
    pub(super) fn not_synced(&mut self, error: &io::Error) {
        self.fail(&format!("the log is not written through to the disk: {error}"));
    }

    /// What is kept goes with the session.
    pub(super) fn forget(&mut self) {
        self.is_forgotten = true;
    }

    /// Whether what is kept goes with the session.
    pub(super) fn is_forgotten(&self) -> bool {
        self.is_forgotten
    }

    /// Ends the thread that writes, after what it was told, and waits for it.
    pub(super) fn end(self) {
        let last = if self.is_forgotten { Order::Remove } else { Order::End };
        // It may have ended by a panic, which was told where it happened.
        let _ = self.orders.send(last);
        let _ = self.writer.join();
    }
}

#[cfg(test)]
mod tests;
