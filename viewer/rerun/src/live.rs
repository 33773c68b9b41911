//! Records live without ever making its caller wait.
//!
//! Enters: `Topology` and `Frame`s from a thread that must not block. Leaves: the newest of them in a viewer.
//! The SDK blocks its producer while a viewer stalls; here a thread of its own takes the blow, behind a slot
//! that holds one frame. A frame that finds the slot taken replaces what is there, and is counted.

use std::{
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, mpsc},
    thread,
    time::{Duration, Instant},
};

use nappe_client::{Frame, Topology};

use crate::{
    coloring::ColorBy,
    error::RerunError,
    recorder::{Recorder, Sink},
};

/// Longest time that [`LiveRecorder::finish`] waits for the viewer.
const FINISH_LIMIT: Duration = Duration::from_secs(10);

/// A recording that is always up to date rather than complete.
pub struct LiveRecorder {
    slot: Arc<Slot>,
}

/// What became of the frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LiveSummary {
    /// Frames given to Rerun.
    pub recorded_count: u64,
    /// Frames replaced by a newer one before Rerun took them.
    pub dropped_count: u64,
}

/// What passes between the caller and the thread.
#[derive(Default)]
struct Slot {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    /// Never dropped: frames make no sense without it.
    topology: Option<Arc<Topology>>,
    frame: Option<Arc<Frame>>,
    is_closing: bool,
    recorded_count: u64,
    dropped_count: u64,
    /// Set by the thread when it is done.
    outcome: Option<Result<(), RerunError>>,
}

impl LiveRecorder {
    /// Starts the thread and opens the recording in it. This call waits for the sink to open.
    ///
    /// # Errors
    /// If the sink cannot be opened: see [`Recorder::open`].
    pub fn start(title: &str, sink: Sink, color_by: ColorBy) -> Result<Self, RerunError> {
        let slot = Arc::new(Slot::default());
        let (opened, is_open) = mpsc::channel();
        let (title, shared) = (title.to_owned(), Arc::clone(&slot));

        let work = move || {
            let recorder = match Recorder::open(&title, sink, color_by) {
                Ok(recorder) => recorder,
                Err(error) => {
                    // Nobody listens only if the caller is gone, who then needs no answer.
                    let _ = opened.send(Err(error));
                    return;
                }
            };
            let _ = opened.send(Ok(()));
            let outcome = shared.drain(recorder);
            shared.lock().outcome = Some(outcome);
            shared.changed.notify_all();
        };

        let thread_error = |cause: String| RerunError::Thread { cause };
        thread::Builder::new()
            .name("nappe-rerun".to_owned())
            .spawn(work)
            .map_err(|error| thread_error(error.to_string()))?;
        is_open.recv().map_err(|_gone| thread_error("it ended before it began".to_owned()))??;
        Ok(Self { slot })
    }

    /// Gives the topology. Never waits for the viewer.
    pub fn topology(&self, topology: Arc<Topology>) {
        let mut state = self.slot.lock();
        state.topology = Some(topology);
        // It belongs to the topology before.
        if state.frame.take().is_some() {
            state.dropped_count += 1;
        }
        self.slot.changed.notify_all();
    }

    /// Gives a frame. Never waits for the viewer.
    pub fn frame(&self, frame: Arc<Frame>) {
        let mut state = self.slot.lock();
        if state.frame.replace(frame).is_some() {
            state.dropped_count += 1;
        }
        self.slot.changed.notify_all();
    }

    /// True once Rerun refused something: nothing more is recorded, and [`Self::finish`] says why.
    pub fn has_failed(&self) -> bool {
        self.slot.lock().outcome.is_some()
    }

    /// Records what is in the slot, closes the recording and waits for it, 10 s at most.
    ///
    /// # Errors
    /// If Rerun refused something, or the viewer does not take the rest in time; the thread is then left behind.
    pub fn finish(self) -> Result<LiveSummary, RerunError> {
        let deadline = Instant::now() + FINISH_LIMIT;
        let mut state = self.slot.lock();
        state.is_closing = true;
        self.slot.changed.notify_all();
        loop {
            if let Some(outcome) = state.outcome.take() {
                outcome?;
                let State { recorded_count, dropped_count, .. } = *state;
                return Ok(LiveSummary { recorded_count, dropped_count });
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(RerunError::Stalled { seconds: FINISH_LIMIT.as_secs_f64() });
            }
            let waited = self.slot.changed.wait_timeout(state, left);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl Drop for LiveRecorder {
    fn drop(&mut self) {
        self.slot.lock().is_closing = true;
        self.slot.changed.notify_all();
    }
}

impl Slot {
    /// No holder of the lock can leave the state half-changed, so a poisoned one is as good.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The thread's work: takes what is new, records it without the lock, until closed and empty.
    fn drain(&self, mut recorder: Recorder) -> Result<(), RerunError> {
        loop {
            let (topology, frame) = {
                let mut state = self.lock();
                while state.topology.is_none() && state.frame.is_none() && !state.is_closing {
                    state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
                }
                (state.topology.take(), state.frame.take())
            };
            if topology.is_none() && frame.is_none() {
                return recorder.finish();
            }
            if let Some(topology) = topology {
                recorder.topology(&topology)?;
            }
            if let Some(frame) = frame {
                recorder.frame(&frame)?;
                self.lock().recorded_count += 1;
            }
        }
    }
}
