//! The thread that owns a simulation: it reads commands between steps, steps at its pace, and
//! publishes frames. It waits for nobody but its own clock and, when idle, the next command.
//!
//! A panic or a divergence ends this session alone, with its reason.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc,
        mpsc::{Receiver, RecvTimeoutError, TryRecvError},
    },
    time::Instant,
};

use nappe_proto::v1;
use nappe_sim::{
    report::StepReport,
    world::{Change, Simulation},
};
use rayon::ThreadPool;

use super::{
    command::{Answer, Command, When},
    pace::Pace,
    pending_changes::Pending,
    start::figures,
    status::Status,
    stopwatch::Laps,
    transition::{Effect, Event, State, transition},
};
use crate::{
    error::{Reason, ServiceError, reason_of},
    stream::{Ending, wire},
};

/// Whether the thread goes on.
enum Flow {
    Continue,
    End,
}

/// A simulation and everything that its thread needs.
pub(crate) struct Stepper {
    pub(crate) simulation: Simulation,
    pub(crate) pool: ThreadPool,
    pub(crate) status: Arc<Status>,
    pub(crate) commands: Receiver<Command>,
    pub(crate) pending: Pending,
    pub(crate) state: State,
    pub(crate) pace: Pace,
    pub(crate) waiting: Vec<Answer>,
    pub(crate) panic_next: bool,
}

impl Stepper {
    /// Runs until the session is deleted.
    pub(crate) fn run(mut self) {
        loop {
            match catch_unwind(AssertUnwindSafe(|| self.turn())) {
                Ok(Flow::Continue) => {}
                Ok(Flow::End) => break,
                Err(payload) => self.panicked(payload.as_ref()),
            }
        }
        let error = super::handle::deleted(&self.status.facts.id);
        self.status.feed.end(Ending::Broken(error.clone()));
        self.answer_waiting(&Err(error));
    }

    /// One command, one step or one wait.
    fn turn(&mut self) -> Flow {
        if !matches!(self.state, State::Playing | State::Stepping { .. }) {
            return self.commands.recv().map_or(Flow::End, |command| self.obey(command));
        }
        let wait = self.pace.wait(Instant::now(), self.simulation.time() + self.simulation.dt());
        let command = if wait.is_zero() {
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
        match command {
            Command::Play { real_time_factor, answer } => {
                let changed = self.change(Event::Play);
                if changed.is_ok() {
                    self.pace = Pace::start(real_time_factor, Instant::now(), self.simulation.time());
                }
                self.reply(answer, changed);
            }
            Command::Step { count, when, answer } => self.begin_steps(count, when, answer),
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
            Command::Provide(answer) => {
                self.provide();
                let _ = answer.send(());
            }
            Command::InjectPanic => self.panic_next = true,
            Command::End => return Flow::End,
        }
        Flow::Continue
    }

    fn begin_steps(&mut self, count: u64, when: When, answer: Answer) {
        let idle = self.state == State::Paused;
        let changed = self.change(Event::Step(count));
        if changed.is_ok() && idle {
            self.pace = Pace::start(0.0, Instant::now(), self.simulation.time());
        }
        if changed.is_ok() && when == When::Done {
            self.waiting.push(answer);
        } else {
            self.reply(answer, changed);
        }
    }

    fn enqueue(&mut self, at_step: u64, changes: Vec<Change>) -> Result<u64, ServiceError> {
        self.change(Event::Update)?;
        self.simulation.check(&changes).map_err(|error| wire::refused(&error))?;
        let effective = at_step.max(self.simulation.step_count());
        self.pending.push(effective, changes)?;
        Ok(effective)
    }

    /// Moves to the state that follows an event and carries out the effect.
    pub(super) fn change(&mut self, event: Event) -> Result<(), ServiceError> {
        let (state, effect) = transition(self.state, event).map_err(|reason| self.refused(reason))?;
        self.state = state;
        match effect {
            Effect::None | Effect::Enqueue => self.note_state(),
            Effect::StepsDone => {
                self.note_state();
                self.answer_waiting(&Ok(self.status.describe()));
            }
            Effect::StepsInterrupted => {
                self.note_state();
                self.answer_waiting(&Err(self.interrupted()));
            }
            Effect::Stopped | Effect::Finish => self.finish(effect),
            // The failure itself is told by `fail`, which knows it.
            Effect::Fail => {}
        }
        Ok(())
    }

    fn refused(&self, reason: Reason) -> ServiceError {
        let id = &self.status.facts.id;
        let message = match reason {
            Reason::SessionPlaying => format!("session '{id}' is playing: pause it to take single steps"),
            Reason::SessionFinished => format!("session '{id}' is finished"),
            _ => format!("session '{id}' failed earlier"),
        };
        let error = ServiceError::new(reason, message).with("session_id", id);
        match self.status.progress().failure {
            Some(failure) => error.with("failure", &failure.reason).with("failure_message", failure.message),
            None => error,
        }
    }

    pub(super) fn interrupted(&self) -> ServiceError {
        let (id, step) = (&self.status.facts.id, self.simulation.step_count());
        let message = format!("session '{id}' was interrupted at step {step}, before the steps were taken");
        ServiceError::new(Reason::StepsInterrupted, message).with("session_id", id).with("step", step)
    }

    fn step(&mut self) {
        let index = self.simulation.step_count();
        for changes in self.pending.take_due(index) {
            if let Err(error) = self.simulation.apply(&changes) {
                // They were checked when they came, and bodies do not change.
                let message = format!("a change before step {index} was refused: {error}");
                return self.fail(ServiceError::new(Reason::Internal, message), index, None, None);
            }
        }
        let (mut laps, begin) = (Laps::start(), Instant::now());
        let (simulation, panic_now) = (&mut self.simulation, self.panic_next);
        let outcome = self.pool.install(|| {
            assert!(!panic_now, "a panic was injected for a test");
            simulation.step(&mut laps)
        });
        let seconds = begin.elapsed().as_secs_f64();
        match outcome {
            Ok(report) => self.stepped(&report, &laps, seconds),
            Err(error) => {
                let failure = &error.failure;
                let told = ServiceError::new(reason_of(failure), error.to_string()).with("body", &error.body);
                self.fail(told, error.step, failure.particle(), failure.value());
            }
        }
    }

    fn stepped(&mut self, report: &StepReport, laps: &Laps, seconds: f64) {
        let facts = &self.status.facts;
        let last = facts.step_limit > 0 && report.step >= facts.step_limit;
        let due = last || report.step.is_multiple_of(facts.frame_interval.into());
        let frame = self.status.feed.newest().frame.head.frame + u64::from(due);
        let diagnostics = figures(report, frame, &laps.seconds, seconds);
        self.status.update(|progress| {
            progress.step = report.step;
            progress.time = report.time;
            progress.stepping_seconds += seconds;
            progress.diagnostics = diagnostics;
        });
        if due && !self.publish(frame) {
            return;
        }
        let event = if last { Event::SteppedLast } else { Event::Stepped };
        self.change(event).expect("a session that stepped may step");
    }

    /// Writes the state where it can be read, with the hash if the session is not stepping.
    pub(super) fn note_state(&mut self) {
        let state = self.state;
        if state == State::Failed {
            // Written when it failed; after a panic the simulation is not looked at again.
            return;
        }
        let idle = !matches!(state, State::Playing | State::Stepping { .. });
        let hash = idle.then(|| self.hash());
        self.status.update(|progress| {
            progress.state = state;
            progress.state_hash = hash;
        });
    }

    /// Hash of the state, computed on the session's own threads.
    pub(super) fn hash(&self) -> u64 {
        let simulation = &self.simulation;
        self.pool.install(|| simulation.state_hash())
    }

    fn reply(&self, answer: Answer, changed: Result<(), ServiceError>) {
        // Whoever asked may be gone.
        let _ = answer.send(changed.map(|()| self.status.describe()));
    }

    pub(super) fn answer_waiting(&mut self, outcome: &Result<v1::Session, ServiceError>) {
        for answer in self.waiting.drain(..) {
            let _ = answer.send(outcome.clone());
        }
    }
}
