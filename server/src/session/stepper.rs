//! The thread that owns a simulation: it reads commands between steps, steps at its pace, and
//! publishes frames. It waits only for its own clock and, when idle, for the next command.
//!
//! A panic or a divergence ends this session alone, with its reason.

use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, RecvTimeoutError, TryRecvError},
    },
    time::Instant,
};

use nappe_proto::v1;
use nappe_sim::world::Change;

use super::{
    command::{Answer, Command, MAX_COMMANDS, Steps, When},
    failure::{FailurePoint, SessionFailure, interrupted, refused},
    pace::Pace,
    parameters::parameters,
    pending_changes::PendingChanges,
    simulator::{FramePosition, Simulator, TimedStep},
    status::Status,
    transition::{Effect, Event, State, transition},
};
use crate::{
    error::{Reason, ServiceError, step_reason},
    stream::{Ending, diagnostics},
};

/// Steps that a change may lie ahead.
const MAX_STEPS_AHEAD: u64 = 10_000_000;

/// Whether the thread goes on.
enum Flow {
    Continue,
    End,
}

/// A simulation and everything that its thread needs.
pub(super) struct Stepper {
    pub simulator: Simulator,
    pub commands: Receiver<Command>,
    /// Commands read since the last step: a step comes before there are too many.
    pub commands_since_step: usize,
    /// Set when the session is deleted.
    pub is_deleted: Arc<AtomicBool>,
    pub pending: PendingChanges,
    pub state: State,
    pub pace: Pace,
    /// Calls that wait for steps to be taken.
    pub waiting: Vec<Answer>,
    /// Whether the next step panics (tests).
    pub panic_next: bool,
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

        let error = ServiceError::session_deleted(self.id());
        self.status().feed.note(v1::ChangeKind::Deleted, self.step_count());
        self.status().feed.end(Ending::Broken(error.clone()));
        self.answer_waiting(&Err(error));
    }

    /// One command, one step or one wait.
    fn turn(&mut self) -> Flow {
        if self.is_deleted.load(Ordering::Relaxed) {
            return Flow::End;
        }
        if !matches!(self.state, State::Playing | State::Stepping { .. }) {
            return self.commands.recv().map_or(Flow::End, |command| self.obey(command));
        }

        let simulation = &self.simulator.simulation;
        let wait = self.pace.wait(Instant::now(), simulation.time() + simulation.dt());
        let command = if wait.is_zero() && self.commands_since_step >= MAX_COMMANDS {
            Err(false)
        } else if wait.is_zero() {
            self.commands.try_recv().map_err(|error| error == TryRecvError::Disconnected)
        } else {
            self.commands.recv_timeout(wait).map_err(|error| error == RecvTimeoutError::Disconnected)
        };

        match command {
            Ok(command) => return self.obey(command),
            Err(true) => return Flow::End,
            Err(false) if wait.is_zero() => self.step(),
            Err(false) => {}
        }
        Flow::Continue
    }

    fn obey(&mut self, command: Command) -> Flow {
        self.commands_since_step += 1;
        if command.is_abandoned() {
            return Flow::Continue;
        }
        match command {
            Command::Play { real_time_factor, answer } => {
                let changed = self.change(Event::Play);
                if changed.is_ok() {
                    self.set_pace(real_time_factor);
                }
                self.reply(answer, changed);
            }
            Command::Step { steps, when, answer } => self.begin_steps(steps, when, answer),
            Command::Pause(answer) => {
                let changed = self.change(Event::Pause);
                self.reply(answer, changed);
            }
            Command::Stop(answer) => {
                let changed = self.change(Event::Stop);
                self.reply(answer, changed);
            }
            Command::Update { at_step, changes, answer } => {
                // Whoever asked may be gone.
                let _ = answer.send(self.enqueue(at_step, changes));
            }
            Command::CompleteNewest(answer) => {
                self.simulator.complete_newest();
                let _ = answer.send(());
            }
            Command::InjectPanic => self.panic_next = true,
            Command::End => return Flow::End,
        }
        Flow::Continue
    }

    fn begin_steps(&mut self, steps: Steps, when: When, answer: Answer) {
        let coming = if let State::Stepping { remaining } = self.state { remaining } else { 0 };
        let changed = match steps {
            Steps::More(count) => self.change(Event::Step(count)),
            Steps::Until(step) if step <= self.step_count() => return self.reply(answer, Ok(())),
            Steps::Until(step) if step <= self.step_count().saturating_add(coming) => Ok(()),
            Steps::Until(step) => self.change(Event::Step(step - self.step_count() - coming)),
        };
        let idle = coming == 0;
        if changed.is_ok() && idle {
            self.set_pace(0.0);
        }

        if changed.is_ok() && when == When::Done {
            self.waiting.push(answer);
        } else {
            self.reply(answer, changed);
        }
    }

    /// Queues changes for their step, and returns the step before which they take effect.
    fn enqueue(&mut self, at_step: u64, changes: Vec<Change>) -> Result<u64, ServiceError> {
        self.change(Event::Update)?;
        let latest = self.step_count().saturating_add(MAX_STEPS_AHEAD);
        if at_step > latest {
            let problem = format!("is {at_step}: allowed is at most {latest}, {MAX_STEPS_AHEAD} steps ahead");
            return Err(ServiceError::field("at_step", problem)
                .with("value", at_step)
                .with("allowed", latest));
        }
        self.simulator.simulation.check(&changes).map_err(|error| ServiceError::from(&error))?;
        let effective = at_step.max(self.step_count());
        self.pending.push(effective, changes)?;
        Ok(effective)
    }

    /// Moves to the state that follows an event and carries out the effect.
    fn change(&mut self, event: Event) -> Result<(), ServiceError> {
        let (state, effect) = transition(self.state, event)
            .map_err(|reason| refused(self.id(), reason, self.status().progress().failure))?;
        self.state = state;

        match effect {
            Effect::None | Effect::Enqueue => self.note_state(),
            Effect::StepsDone => {
                self.note_state();
                self.answer_waiting(&Ok(self.status().describe()));
            }
            Effect::StepsInterrupted => {
                self.note_state();
                self.answer_waiting(&Err(interrupted(self.id(), self.step_count())));
            }
            Effect::Stopped | Effect::Finish => self.finish(effect),
            // `fail` tells of the failure, because it knows the reason.
            Effect::Fail => {}
        }
        Ok(())
    }

    fn step(&mut self) {
        self.commands_since_step = 0;
        let index = self.step_count();
        let due = self.pending.take_due(index);
        if !due.is_empty() {
            self.status().feed.note(v1::ChangeKind::Parameters, index);
        }
        for changes in due {
            if let Err(error) = self.simulator.simulation.apply(&changes) {
                // They were checked when they came, and bodies do not change.
                let message = format!("a change before step {index} was refused: {error}");
                return self.fail(ServiceError::internal(message), index, None, None);
            }
            let now = parameters(self.simulator.simulation.parameters());
            self.status().update(|progress| progress.parameters = now);
        }

        let panic_now = self.panic_next;
        let outcome = self.simulator.step(|| assert!(!panic_now, "a panic was injected for a test"));
        match outcome {
            Ok(step) => self.stepped(&step),
            Err(error) => {
                let failure = &error.failure;
                let refused = ServiceError::new(step_reason(failure), error.to_string());
                let refused = refused.with("body", &error.body);
                self.fail(refused, error.step, failure.particle(), failure.value());
            }
        }
    }

    fn stepped(&mut self, step: &TimedStep) {
        let properties = &self.status().properties;
        let TimedStep { report, seconds, stage_seconds } = step;
        let last = properties.step_limit > 0 && report.step >= properties.step_limit;
        let due = last || report.step.is_multiple_of(properties.frame_interval_steps.into());
        let frame = self.newest_frame() + u64::from(due);

        let diagnostics = diagnostics(report, frame, stage_seconds, *seconds);
        self.status().update(|progress| {
            progress.step = report.step;
            progress.time_seconds = report.time;
            progress.stepping_seconds += seconds;
            progress.diagnostics = diagnostics;
        });

        let position = if last { FramePosition::Last } else { FramePosition::Middle };
        if due && !self.publish(frame, position) {
            return;
        }

        let event = if last { Event::SteppedLast } else { Event::Stepped };
        self.change(event).expect("a session that stepped may step");
    }

    /// Publishes the state as frame `frame`; false if that failed the session.
    fn publish(&mut self, frame: u64, position: FramePosition) -> bool {
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
    fn finish(&mut self, effect: Effect) {
        let is_published = self.status().feed.newest().frame.head.step == self.step_count();
        if !is_published && !self.publish(self.newest_frame() + 1, FramePosition::Last) {
            return;
        }

        self.note_state();
        let head = &self.status().feed.newest().frame.head;
        self.status().feed.end(Ending::Finished(v1::SessionEnd {
            frame: head.frame,
            step: head.step,
            state_hash: self.simulator.hash(),
        }));

        let answer = match effect {
            Effect::Finish => Ok(self.status().describe()),
            _ => Err(interrupted(self.id(), self.step_count())),
        };
        self.answer_waiting(&answer);
    }

    /// Ends the session with an error that arose in step `step`.
    fn fail(&mut self, error: ServiceError, step: u64, particle: Option<u64>, value: Option<f64>) {
        self.change(Event::Broke).expect("a session that stepped may fail");
        tracing::warn!(session = self.id(), step, "{error}");
        let time_seconds = self.simulator.simulation.time();
        let point = FailurePoint { step, time_seconds, particle, value };
        self.note_failure(SessionFailure::new(self.id(), error, point));
    }

    /// Ends the session with a panic in a step.
    fn panicked(&mut self, payload: &(dyn Any + Send)) {
        self.panic_next = false;
        self.state = State::Failed;
        let progress = self.status().progress();
        let failed = SessionFailure::panicked(self.id(), payload, &progress);
        tracing::error!(session = self.id(), step = progress.step, "{}", failed.error.message);
        self.note_failure(failed);
    }

    fn note_failure(&mut self, SessionFailure { failure, error }: SessionFailure) {
        let newest = self.status().feed.newest().frame;
        let is_newest = newest.head.step == self.step_count();
        let is_intact = self.simulator.is_intact(Some(&failure));
        let state_hash = match is_intact {
            true => Some(self.simulator.hash()),
            false if is_newest => newest.head.state_hash,
            false => None,
        };
        self.status().update(|progress| {
            progress.state = State::Failed;
            progress.state_hash = state_hash;
            progress.failure = Some(failure);
        });

        // The last good state becomes a frame, unless it cannot be encoded.
        if is_intact && !is_newest {
            let _ = self.simulator.publish(newest.head.frame + 1, FramePosition::Last);
        }

        self.status().feed.end(Ending::Broken(error.clone()));
        self.answer_waiting(&Err(error));
    }

    /// Writes the state where it can be read, with the hash if the session is not stepping.
    fn note_state(&mut self) {
        let state = self.state;
        if state == State::Failed {
            // Written when it failed; after a panic the simulation is not looked at again.
            return;
        }

        let idle = !matches!(state, State::Playing | State::Stepping { .. });
        let hash = idle.then(|| self.simulator.hash());
        self.status().update(|progress| {
            progress.state = state;
            progress.state_hash = hash;
        });
    }

    /// Starts a new run at the current time, with `factor` simulated seconds per second.
    fn set_pace(&mut self, factor: f64) {
        self.pace = Pace::start(factor, Instant::now(), self.simulator.simulation.time());
    }

    fn reply(&self, answer: Answer, changed: Result<(), ServiceError>) {
        // Whoever asked may be gone.
        let _ = answer.send(changed.map(|()| self.status().describe()));
    }

    fn answer_waiting(&mut self, outcome: &Result<v1::Session, ServiceError>) {
        for answer in self.waiting.drain(..) {
            let _ = answer.send(outcome.clone());
        }
    }

    fn status(&self) -> &Status {
        &self.simulator.status
    }

    fn id(&self) -> &str {
        &self.simulator.status.properties.id
    }

    fn step_count(&self) -> u64 {
        self.simulator.simulation.step_count()
    }

    /// Number of the newest frame.
    fn newest_frame(&self) -> u64 {
        self.status().feed.newest().frame.head.frame
    }
}
