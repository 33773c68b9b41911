//! The thread that owns a simulation: it asks what to do next, does it, and tells what came of it.
//!
//! It waits only for its own clock, for a watcher that it is to wait for and, when idle, for the next call. A panic
//! or a divergence ends this session alone, with its reason.

use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
};

use nappe_proto::v1;
use nappe_sim::{report::StepFailure, world::Change};
use prost::Message as _;
use tokio::sync::oneshot;

use super::{
    control::Control,
    desk::{Copied, Injected},
    failure::{FailurePoint, SessionFailure},
    notices,
    parameters::{parameters, put_collider_poses},
    pending_changes::{Accepted, Queue},
    schedule::Task,
    simulator::{Behind, FramePosition, NoStep, Simulator, TimedStep},
    status::Status,
    transition::{Effect, Event},
};
use crate::{
    counters::Counters,
    error::{Reason, ServiceError, step_reason},
    state::Record,
    stream::{Ending, diagnostics, initial_diagnostics, rejected},
};

/// Whether the thread goes on.
enum Flow {
    Continue,
    End,
}

/// A simulation and everything that its thread needs.
pub(super) struct Stepper {
    pub simulator: Simulator,
    pub control: Arc<Control>,
    pub counters: Arc<Counters>,
    /// Who waits for the frame that is being completed: told after a panic's failure is noted, not before.
    pub completing: Vec<oneshot::Sender<()>>,
}

impl Stepper {
    /// Runs until the session is deleted.
    pub(super) fn run(mut self) {
        loop {
            match catch_unwind(AssertUnwindSafe(|| self.turn())) {
                Ok(Flow::Continue) => {}
                Ok(Flow::End) => break,
                Err(payload) => self.panicked(payload.as_ref()),
            }
        }

        // A panic in it was told where it happened.
        let _ = catch_unwind(AssertUnwindSafe(|| self.end_keeping()));
        let error = ServiceError::session_deleted(self.id());
        self.status().feed.note(v1::ChangeKind::Deleted, self.step_count());
        self.status().feed.end(Ending::Broken(error.clone()));
        self.control.ended(&error);
    }

    /// One step, or one of the things that happen between steps.
    fn turn(&mut self) -> Flow {
        let simulation = &self.simulator.simulation;
        let end_time = simulation.time() + simulation.dt();
        let feed = &self.status().feed;
        match self.control.next(end_time, || feed.has_room()) {
            Task::Step { changes, injected } => self.step(&changes, injected),
            Task::LoseRanks => self.lose_ranks(),
            Task::Settle { frames } if self.catch_up() => {
                let hash = self.simulator.hash_if_intact();
                self.simulator.show(frames, hash);
                self.control.settled(hash);
            }
            Task::Copy { to, pending } if self.catch_up() => self.copy(to, &pending),
            Task::Save { to, pending } if self.catch_up() => self.simulator.save(to, &pending),
            Task::Keep { place, pending } => self.keep(place, pending),
            Task::Reset { done } if self.catch_up() => self.reset(done),
            Task::Try { trials } => self.simulator.try_out(trials),
            // Who waits is told of the failure.
            Task::Settle { .. } | Task::Copy { .. } | Task::Save { .. } | Task::Reset { .. } => {}
            Task::Complete { done, injected } => self.complete(done, injected),
            Task::Stop => {
                if self.control.stop_now() {
                    self.finish();
                }
            }
            Task::End => return Flow::End,
        }
        Flow::Continue
    }

    /// Hands out copies, unless the state may be half changed.
    fn copy(&self, to: Vec<oneshot::Sender<Copied>>, pending: &Queue) {
        for copy in to.into_iter().filter(|_| !self.simulator.is_torn) {
            let simulation = self.simulator.simulation.fork();
            // Whoever asked may be gone.
            let _ = copy.send(Copied { simulation, pending: pending.clone() });
        }
    }

    /// Puts the session back to its start, and shows it in a frame.
    fn reset(&mut self, done: Vec<(oneshot::Sender<Accepted>, Accepted)>) {
        let index = self.step_count();
        if let Some((_, Accepted { step, order })) = done.last() {
            self.control.note(&Record::Reset { step: *step, order: *order });
        }
        self.status().feed.note(v1::ChangeKind::Reset, index);
        let changes = [&[Change::Reset], &*self.status().properties.initial_changes].concat();
        if let Err(error) = self.simulator.apply(&changes) {
            self.simulator.is_torn |= self.simulator.ranks.is_some();
            return self.fail(error, index, None, None);
        }
        // The copy of what ranks step has been put back too.
        self.simulator.behind = Behind::Nothing;
        let frame = self.newest_frame() + 1;
        let simulation = &self.simulator.simulation;
        let now = parameters(simulation);
        let diagnostics = self.simulator.pool.install(|| initial_diagnostics(simulation));
        self.status().update(|progress| {
            progress.parameters = now;
            let notices = progress.diagnostics.notices.take();
            progress.diagnostics = v1::Diagnostics { frame, notices, ..diagnostics };
        });
        if self.publish(frame, FramePosition::Middle) {
            self.control.has_reset();
            for (done, accepted) in done {
                // Whoever asked may be gone.
                let _ = done.send(accepted);
            }
        }
    }

    fn complete(&mut self, done: Vec<oneshot::Sender<()>>, injected: Injected) {
        self.completing = done;
        self.catch_up();
        injected.carry_out();
        self.simulator.complete_newest();
        for done in self.completing.drain(..) {
            // Whoever asked may be gone.
            let _ = done.send(());
        }
    }

    fn step(&mut self, due: &[Vec<Change>], injected: Injected) {
        let index = self.step_count();
        if !due.is_empty() {
            self.status().feed.note(v1::ChangeKind::Parameters, index);
        }
        for changes in due {
            if let Err(error) = self.simulator.apply(changes) {
                // Given up as a step is.
                if error.reason == Reason::RequestCancelled {
                    return self.control.interrupted();
                }
                self.simulator.is_torn |= self.simulator.ranks.is_some();
                return self.fail(error, index, None, None);
            }
            let now = parameters(&self.simulator.simulation);
            self.status().update(|progress| progress.parameters = now);
        }
        if !due.is_empty() {
            self.control.made_changes();
        }

        match self.simulator.step(|| injected.carry_out()) {
            Ok(step) => match self.simulator.count_growth() {
                Ok(()) => self.stepped(&step),
                Err(full) => self.fail(full, index, None, None),
            },
            Err(NoStep::Full(full)) => self.fail(full, index, None, None),
            Err(NoStep::Lost(lost)) => {
                self.simulator.is_torn = true;
                self.fail(lost, index, None, None);
            }
            Err(NoStep::Failed(error)) if error.failure == StepFailure::Interrupted => {
                self.simulator.is_torn = self.status().properties.snow_cell.is_some();
                self.control.interrupted();
            }
            Err(NoStep::Failed(error)) => {
                let failure = &error.failure;
                let refused = ServiceError::new(step_reason(failure), error.to_string());
                let refused = refused.with("body", &error.body);
                self.fail(refused, error.step, failure.particle(), failure.value());
            }
        }
    }

    fn stepped(&mut self, step: &TimedStep) {
        self.counters.steps.add(1);
        let properties = &self.status().properties;
        let TimedStep { report, seconds, stage_seconds } = step;
        let last = properties.step_limit > 0 && report.step >= properties.step_limit;
        let due = last || report.step.is_multiple_of(properties.frame_interval_steps.into());
        let frame = self.newest_frame() + u64::from(due);

        let simulation = &self.simulator.simulation;
        let mut diagnostics = diagnostics(report, simulation.colliders(), frame, stage_seconds, *seconds);
        let mut first = Vec::new();
        self.status().update(|progress| {
            let (counts, told) = notices::add(progress.diagnostics.notices.unwrap_or_default(), report);
            (diagnostics.notices, first) = (Some(counts), told);
            progress.step = report.step;
            progress.time_seconds = report.time;
            progress.stepping_seconds += seconds;
            if diagnostics.max_stretch > progress.largest_stretch[0] {
                progress.largest_stretch = [diagnostics.max_stretch, report.time];
            }
            progress.diagnostics = diagnostics;
            // Pulls end by themselves; otherwise only the wind and colliders go on without a call.
            if progress.parameters.cloths.iter().any(|cloth| cloth.pull_count > 0) {
                progress.parameters = parameters(simulation);
            } else {
                progress.parameters.wind = Some(simulation.wind().into());
                put_collider_poses(&mut progress.parameters, |index| simulation.collider_pose(index));
            }
        });

        for rejection in &report.rejections {
            self.status().feed.note_rejected(rejected(rejection), report.step);
        }
        for notice in first {
            tracing::warn!(session = self.id(), "{notice}");
            self.status().feed.note_doubt(notice, report.step);
        }

        let position = if last { FramePosition::Last } else { FramePosition::Middle };
        if due && !self.publish(frame, position) {
            return;
        }

        let event = if last { Event::SteppedLast } else { Event::Stepped };
        let effect = self.control.stepped(event);
        if effect == Effect::Finish {
            self.finish();
        }
    }

    /// Publishes the state as frame `frame`; false if that failed the session.
    fn publish(&mut self, frame: u64, position: FramePosition) -> bool {
        let unseen = self.simulator.unseen(frame, position);
        if !self.catch_up_but(unseen) {
            return false;
        }
        self.note_frame(frame);
        match self.simulator.publish(frame, position) {
            Ok(()) => true,
            Err(error) => {
                let last_step = self.step_count().saturating_sub(1);
                let refused = ServiceError::new(Reason::NotFinite, error.to_string());
                self.fail(refused, last_step, error.particle(), Some(error.value));
                false
            }
        }
    }

    /// Publishes the last frame, ends the streams, and answers the calls that wait.
    fn finish(&mut self) {
        if !self.catch_up() {
            return;
        }
        let is_published = self.status().feed.newest().frame.head.step == self.step_count();
        if is_published {
            self.simulator.hash_newest();
        } else if !self.simulator.is_torn && !self.publish(self.newest_frame() + 1, FramePosition::Last) {
            return;
        }

        // Told before the streams end, so that who sees the end has seen the change of state.
        self.control.finished(self.simulator.hash_if_intact());
        tracing::info!(session = self.id(), step = self.step_count(), "finished");
        let head = &self.status().feed.newest().frame.head;
        self.status().feed.end(Ending::Finished(v1::SessionEnd {
            frame: head.frame,
            step: head.step,
            state_hash: head.state_hash.unwrap_or_default(),
        }));
        self.simulator.ranks = None;
    }

    /// Ends the session with an error that arose in step `step`.
    pub(super) fn fail(&mut self, error: ServiceError, step: u64, particle: Option<u64>, value: Option<f64>) {
        tracing::warn!(session = self.id(), step, reason = error.reason.name(), "failed: {}", error.message);
        let time_seconds = self.simulator.simulation.time();
        let point = FailurePoint { step, time_seconds, particle, value };
        // Snow that failed may stand between two of its steps.
        self.simulator.is_torn |= self.status().properties.snow_cell.is_some();
        self.note_failure(SessionFailure::new(self.id(), error, point));
    }

    /// Ends the session with a panic, after which the simulation is not looked at again.
    fn panicked(&mut self, payload: &(dyn Any + Send)) {
        let progress = self.status().progress();
        let failed = SessionFailure::panicked(self.id(), payload, &progress);
        let ServiceError { reason, message, .. } = &failed.error;
        tracing::error!(
            session = self.id(),
            step = progress.step,
            reason = reason.name(),
            "failed: {message}"
        );
        self.simulator.is_torn = true;
        self.note_failure(failed);
        self.completing.clear();
    }

    /// Fetches the state from ranks that step it; false if that failed the session.
    pub(super) fn catch_up(&mut self) -> bool {
        self.catch_up_but(Behind::Nothing)
    }

    /// The same, but for what nobody looks at.
    fn catch_up_but(&mut self, unseen: Behind) -> bool {
        match self.simulator.fetch(unseen) {
            Ok(()) => true,
            Err(lost) => {
                self.fail(lost, self.step_count().saturating_sub(1), None, None);
                false
            }
        }
    }

    fn note_failure(&mut self, SessionFailure { failure, error }: SessionFailure) {
        self.counters.failures.add(1);
        // Of ranks that are lost too, the state is torn, and not looked at.
        let _ = self.simulator.fetch(Behind::Nothing);
        let newest = self.status().feed.newest().frame;
        let is_newest = newest.head.step == self.step_count();
        let hash = match self.simulator.hash_if_intact() {
            None if is_newest => newest.head.state_hash,
            hash => hash,
        };

        // The last good state becomes a frame, unless it cannot be encoded.
        if !self.simulator.is_torn && !is_newest {
            self.note_frame(newest.head.frame + 1);
            let _ = self.simulator.publish(newest.head.frame + 1, FramePosition::Last);
        }

        // What fails while it ends does so again where the session goes on.
        if !self.control.is_deleted() {
            self.control.note(&Record::Failed(failure.encode_to_vec()));
        }
        // Told before the streams end, so that who sees the end can read why.
        self.control.failed(&error, failure, hash);
        self.status().feed.end(Ending::Broken(error));
        self.simulator.ranks = None;
    }

    /// The log has the number of a frame before anybody can see it.
    fn note_frame(&self, frame: u64) {
        self.control.note(&Record::Frame { frame, step: self.step_count() });
    }

    pub(super) fn status(&self) -> &Status {
        &self.simulator.status
    }

    fn id(&self) -> &str {
        &self.simulator.status.properties.id
    }

    pub(super) fn step_count(&self) -> u64 {
        self.simulator.simulation.step_count()
    }

    /// Number of the newest frame.
    fn newest_frame(&self) -> u64 {
        self.status().feed.newest().frame.head.frame
    }
}
