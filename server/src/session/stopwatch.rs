//! The stopwatch of a session's steps: seconds per stage. The simulation library reads no clock.

use std::time::Instant;

use nappe_sim::report::{Stage, Stopwatch};

/// Seconds per stage of one step.
#[derive(Debug)]
pub(crate) struct Laps {
    last: Instant,
    /// Seconds, in the order of `Stage::ALL`.
    pub(crate) seconds: [f64; Stage::ALL.len()],
}

impl Laps {
    pub(crate) fn start() -> Self {
        Self { last: Instant::now(), seconds: [0.0; Stage::ALL.len()] }
    }
}

impl Stopwatch for Laps {
    fn lap(&mut self, stage: Stage) {
        let now = Instant::now();
        if let Some(index) = Stage::ALL.iter().position(|known| *known == stage) {
            self.seconds[index] += now.duration_since(self.last).as_secs_f64();
        }
        self.last = now;
    }
}
