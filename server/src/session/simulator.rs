//! A simulation with the threads that step it, and the frames that are made of its states.
//!
//! Enters: the number of a frame. Leaves: frames in the session's feed, hashes, reports of steps.

use std::{cell::Cell, sync::Arc, time::Instant};

use nappe_sim::{
    field::Field,
    report::{StageClock, StageSeconds, StepError, StepFailure, StepReport},
    world::{Change, ChangeError, Simulation},
};
use rayon::ThreadPool;
use tokio::sync::oneshot;

use super::{
    desk::Trial, pending_changes::Queue, ranks::Ranks, status::Status, taken::Taken, waiting::FrameWish,
};
use crate::{
    error::ServiceError,
    memory::Claim,
    stream::{Arrays, EncodedFrame, FieldSet, FrameHead, NotFinite},
};

/// Where a frame stands among those of its session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FramePosition {
    /// Carries a hash every `hash_interval` frames.
    Middle,
    /// Always carries a hash.
    Last,
}

/// A step that was taken, and the wall-clock time that it took.
#[derive(Clone, Debug)]
pub(super) struct TimedStep {
    pub report: StepReport,
    pub seconds: f64,
    pub stage_seconds: StageSeconds,
}

/// What of a copy is older than the simulation that ranks have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Behind {
    Nothing,
    /// Positions are there, which is all that most frames show.
    AllButPositions,
    All,
}

/// Why a step was not taken.
pub(super) enum NoStep {
    /// The numerics refused it; the state is as before it.
    Failed(Box<StepError>),
    /// The server has no memory for it; the state is as before it.
    Full(ServiceError),
    /// A rank is lost.
    Lost(ServiceError),
}

/// A simulation, its threads, and where its frames go.
pub(super) struct Simulator {
    pub simulation: Simulation,
    pub pool: ThreadPool,
    pub status: Arc<Status>,
    /// Where frames take their arrays from.
    pub arrays: Arc<Arrays>,
    /// Hash of the state after so many steps, if it is known.
    pub hashed: Cell<Option<(u64, u64)>>,
    /// What is counted for it of the server's memory.
    pub memory: Claim,
    /// Bytes of the snow that are counted: its grid grows as it flies apart.
    pub snow_bytes: u64,
    /// Bytes that are counted for ways and forces: calls give others, and longer ones.
    pub changed_bytes: u64,
    /// Bytes that are counted for pairs of surfaces that may meet: they take no more.
    pub pair_bytes: u64,
    /// The ranks that step it, where it does not itself: the simulation is then a copy, into which the state is fetched
    /// before anything looks at it.
    pub ranks: Option<Ranks>,
    /// What of the copy is older than what the ranks have.
    pub behind: Behind,
    /// Whether the state may be half changed: after a panic, and where a step of the world ended between two steps
    /// of the snow. Such a state is not looked at again.
    pub is_torn: bool,
}

impl Simulator {
    /// Takes a step on the session's own threads, after `before` has run there, or has the ranks take it.
    ///
    /// # Errors
    /// If the step is not taken; the state of cloth is as before it. Or if a rank is lost.
    pub(super) fn step(&mut self, before: impl FnOnce() + Send) -> Result<TimedStep, NoStep> {
        let begin = Instant::now();
        let Some(ranks) = &mut self.ranks else { return self.step_alone(begin, before) };

        before();
        let stepped = ranks.step().map_err(NoStep::Lost)?;
        let report = stepped.result.map_err(|error| NoStep::Failed(Box::new(error)))?;
        self.simulation.count_step();
        self.behind = Behind::All;
        let told = ranks.describe();
        self.status.update(|progress| progress.ranks = Some(told));
        // What a rank did not tell is 0.
        let stage_seconds = std::array::from_fn(|stage| stepped.seconds.get(stage).copied().unwrap_or(0.0));
        Ok(TimedStep { report, seconds: begin.elapsed().as_secs_f64(), stage_seconds })
    }

    /// Takes a step that began now, without ranks. Where there is no room for the pairs of surfaces, room is made, and the step is taken again.
    fn step_alone(&mut self, begin: Instant, before: impl FnOnce() + Send) -> Result<TimedStep, NoStep> {
        let mut clock = StageClock::start(|| begin.elapsed().as_secs_f64());
        self.pool.install(before);
        let outcome = loop {
            let simulation = &mut self.simulation;
            match self.pool.install(|| simulation.step(&mut clock)) {
                Err(StepError { failure: StepFailure::PairMemory { bytes }, .. }) => {
                    self.make_room(bytes).map_err(NoStep::Full)?;
                }
                outcome => break outcome,
            }
        };
        if outcome.is_err() {
            // Where forces jump, the past was forgotten before the step.
            self.hashed.set(None);
        }
        let seconds = begin.elapsed().as_secs_f64();
        let stepped = outcome.map(|report| TimedStep { report, seconds, stage_seconds: clock.seconds });
        stepped.map_err(|error| NoStep::Failed(Box::new(error)))
    }

    /// Makes room for so many bytes of pairs of surfaces: for a quarter more, if there is as much, so that few steps are taken again.
    fn make_room(&mut self, bytes: u64) -> Result<(), ServiceError> {
        self.count_pairs(bytes.saturating_add(bytes / 4)).or_else(|_full| self.count_pairs(bytes))
    }

    /// Applies changes between two steps.
    ///
    /// # Errors
    /// What is wrong with them, or with the ranks; or that they were given up with the session, which stands as before them.
    pub(super) fn apply(&mut self, changes: &[Change]) -> Result<(), ServiceError> {
        // The hash of the state covers parameters.
        self.hashed.set(None);
        let simulation = &mut self.simulation;
        let applied = if simulation.rules().puts_surfaces(changes) {
            let interrupt = simulation.interrupt().clone();
            self.pool.install(|| interrupt.leave_at_points(|| simulation.apply(changes)))?
        } else {
            simulation.apply(changes)
        };
        if let Err(error) = applied {
            let step = simulation.step_count();
            return Err(match error {
                // Nobody knew when they came where bodies would be.
                ChangeError::NotApart { .. } => ServiceError::from(&error),
                // All else was checked then, and bodies do not change.
                _ => ServiceError::internal(format!("a change before step {step} was refused: {error}")),
            });
        }
        match &mut self.ranks {
            None => Ok(()),
            Some(ranks) => {
                self.behind = Behind::All;
                ranks.apply(changes)
            }
        }
    }

    /// Tells whether changes could be made now, unless the state may be half changed.
    pub(super) fn try_out(&self, trials: Vec<Trial>) {
        let simulation = &self.simulation;
        for Trial { changes, interrupt, done } in trials.into_iter().filter(|_| !self.is_torn) {
            let tried = self.pool.install(|| interrupt.leave_at_points(|| simulation.check(&changes)));
            // Of what was given up nobody is told: the session ends, or who asked is gone.
            if let Ok(tried) = tried {
                let _ = done.send(tried.map_err(|error| ServiceError::from(&error)));
            }
        }
    }

    /// Takes what is to be saved of the state as it is, unless it may be half changed.
    pub(super) fn save(&self, to: Vec<oneshot::Sender<Taken>>, pending: &Queue) {
        for save in to.into_iter().filter(|_| !self.is_torn) {
            // Whoever asked may be gone.
            let _ = save.send(self.taken(pending.clone()));
        }
    }

    /// What is to be saved of the state as it is, which is not half changed.
    pub(super) fn taken(&self, pending: Queue) -> Taken {
        let simulation = &self.simulation;
        let state = self.pool.install(|| simulation.take());
        let newest = self.status.feed.newest().frame;
        Taken { session: self.status.describe(), state, state_hash: self.hash(), newest, pending }
    }

    /// Fetches what the ranks have, before somebody looks at it, until no more than `left` is behind.
    ///
    /// # Errors
    /// If a rank is lost: the state is then not looked at again.
    pub(super) fn fetch(&mut self, left: Behind) -> Result<(), ServiceError> {
        let Some(ranks) = self.ranks.as_mut().filter(|_| self.behind > left && !self.is_torn) else {
            return Ok(());
        };
        let simulation = &mut self.simulation;
        let fetched = match left {
            Behind::AllButPositions => ranks.look(Field::Positions).map(|taken| simulation.put_field(&taken)),
            _ => ranks.take().map(|state| simulation.put(&state)),
        };
        self.is_torn = fetched.is_err();
        self.behind = left;
        fetched
    }

    /// What may be behind in a frame at this position.
    pub(super) fn unseen(&self, frame: u64, position: FramePosition) -> Behind {
        let shows_more = !FieldSet::ALWAYS.covers(self.status.feed.demand());
        if shows_more || self.is_hashed(frame, position) { Behind::Nothing } else { Behind::AllButPositions }
    }

    fn is_hashed(&self, frame: u64, position: FramePosition) -> bool {
        let interval = self.status.properties.hash_interval.into();
        frame.is_multiple_of(interval) || position == FramePosition::Last
    }

    /// Counts by how much the grid of the snow, ways and forces that calls gave, and the pairs of surfaces have grown.
    ///
    /// # Errors
    /// If the server has not as much memory left.
    pub(super) fn count_growth(&mut self) -> Result<(), ServiceError> {
        let bytes = self.simulation.snow_memory_bytes() as u64;
        if bytes > self.snow_bytes {
            self.memory.grow(bytes - self.snow_bytes)?;
            self.snow_bytes = bytes;
        }
        let bytes = self.simulation.changed_memory_bytes() as u64;
        if bytes > self.changed_bytes {
            self.memory.grow(bytes - self.changed_bytes)?;
            self.changed_bytes = bytes;
        }
        self.count_pairs(self.simulation.pair_memory_bytes() as u64)
    }

    /// Counts so many bytes for pairs of surfaces, unless more are counted already: they take no more than what is counted.
    fn count_pairs(&mut self, bytes: u64) -> Result<(), ServiceError> {
        if bytes > self.pair_bytes {
            self.memory.grow(bytes - self.pair_bytes)?;
            self.pair_bytes = bytes;
        }
        self.simulation.limit_pair_memory(self.pair_bytes);
        Ok(())
    }

    /// Hash of the state.
    fn hash(&self) -> u64 {
        let step = self.simulation.step_count();
        match self.hashed.get() {
            Some((hashed_step, hash)) if hashed_step == step => hash,
            _ => {
                let simulation = &self.simulation;
                let hash = self.pool.install(|| simulation.state_hash());
                self.hashed.set(Some((step, hash)));
                hash
            }
        }
    }

    /// Hash of the state, unless it may be half changed.
    pub(super) fn hash_if_intact(&self) -> Option<u64> {
        (!self.is_torn).then(|| self.hash())
    }

    /// Gives the newest frame, which is of the state as it is, its hash.
    pub(super) fn hash_newest(&self) {
        let newest = self.status.feed.newest().frame;
        if newest.head.state_hash.is_none()
            && let Some(hash) = self.hash_if_intact()
        {
            self.status.feed.publish(newest.with_hash(hash));
        }
    }

    /// Publishes the state as frame `frame`.
    ///
    /// # Errors
    /// The first number that is not finite; nothing is published then.
    pub(super) fn publish(&self, frame: u64, position: FramePosition) -> Result<(), NotFinite> {
        let diagnostics = self.status.progress().diagnostics;
        let mut head = FrameHead::of(&self.simulation, frame, diagnostics);
        head.state_hash = self.is_hashed(frame, position).then(|| self.hash());

        let encoded = self.encode(self.status.feed.demand(), head)?;
        self.status.feed.publish(encoded);
        Ok(())
    }

    /// Makes the frames of the state as it is that answers have. One that cannot be made leaves its wish unmet.
    pub(super) fn show(&self, frames: Vec<FrameWish>, state_hash: Option<u64>) {
        let step = self.simulation.step_count();
        for FrameWish { fields, step: wished, done } in frames {
            if wished != step || self.is_torn {
                continue;
            }
            let newest = self.status.feed.newest().frame.head.frame;
            let head = FrameHead::of(&self.simulation, newest, self.status.progress().diagnostics);
            if let Ok(frame) = self.encode(fields, FrameHead { state_hash, ..head }) {
                // Whoever asked may be gone.
                let _ = done.send(Arc::new(frame));
            }
        }
    }

    /// Encodes the newest frame again with everything in demand, if its state still stands.
    pub(super) fn complete_newest(&self) {
        let newest = self.status.feed.newest().frame;
        let stands = newest.head.step == self.simulation.step_count() && !self.is_torn;
        if stands && !newest.fields().covers(self.status.feed.demand()) {
            let missing = self.status.feed.demand().without(newest.fields());

            // A number that cannot be encoded fails the session at its next frame, if there is one.
            if let Ok(more) = self.encode(missing, newest.head.clone()) {
                self.status.feed.publish(newest.with_more(more));
            }
        }
    }

    fn encode(&self, wanted: FieldSet, head: FrameHead) -> Result<EncodedFrame, NotFinite> {
        let (simulation, arrays) = (&self.simulation, &self.arrays);
        self.pool.install(|| EncodedFrame::encode(simulation, wanted, head, arrays))
    }
}
