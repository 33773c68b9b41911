//! The stopwatch of a session's steps. The simulation library reads no clock.

use std::time::Instant;

use nappe_sim::report::{Stage, Stopwatch};

use crate::stream::StageSeconds;

/// Measures how long each stage of one step takes.
#[derive(Debug)]
pub(super) struct StageStopwatch {
    last: Instant,
    pub(super) seconds: StageSeconds,
}

impl StageStopwatch {
    pub(super) fn start() -> Self {
        Self { last: Instant::now(), seconds: [0.0; Stage::ALL.len()] }
    }

    /// Seconds that somebody else measured, in the order of the stages.
    pub(super) fn of(seconds: &[f64]) -> StageSeconds {
        std::array::from_fn(|stage| seconds.get(stage).copied().unwrap_or(0.0))
    }
}

impl Stopwatch for StageStopwatch {
    fn lap(&mut self, stage: Stage) {
        let now = Instant::now();
        if let Some(index) = Stage::ALL.iter().position(|known| *known == stage) {
            self.seconds[index] += now.duration_since(self.last).as_secs_f64();
        }
        self.last = now;
    }
}
