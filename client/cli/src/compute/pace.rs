//! Lines that tell how far a simulation is, for a file or a pipe: one after each interval, and none before the first is over.
//!
//! Enters: steps as they are taken, and instants. Leaves: lines.

use std::{
    cell::Cell,
    time::{Duration, Instant},
};

use crate::output;

/// How far a simulation is, and when that is told next.
#[derive(Debug)]
pub(crate) struct Pace {
    /// Steps to the end; 0: it has none.
    step_limit: u64,
    interval: Duration,
    begin: Instant,
    /// When the next line is due.
    due: Cell<Instant>,
    /// The last step that is known of, and its time in the scene (s).
    reached: Cell<(u64, f64)>,
}

impl Pace {
    /// A simulation of so many steps that begins now; 0 when it does not end by itself.
    pub(crate) fn new(step_limit: u64, interval: Duration, now: Instant) -> Self {
        let (due, reached) = (Cell::new(now + interval), Cell::new((0, 0.0)));
        Self { step_limit, interval, begin: now, due, reached }
    }

    /// Notes a step, and its time in the scene (s).
    pub(crate) fn see(&self, step: u64, time: f64) {
        self.reached.set((step, time));
    }

    /// How long it is until the next line is due.
    pub(crate) fn wait(&self, now: Instant) -> Duration {
        self.due.get().saturating_duration_since(now)
    }

    /// The line that is due, if one is.
    pub(crate) fn line(&self, now: Instant) -> Option<String> {
        if now < self.due.get() {
            return None;
        }
        self.due.set(now + self.interval);
        Some(self.told(now.saturating_duration_since(self.begin).as_secs_f64()))
    }

    /// How far it is after so many seconds.
    fn told(&self, seconds: f64) -> String {
        let (step, time) = self.reached.get();
        let of = if self.step_limit > 0 {
            format!(" of {}", output::count(self.step_limit))
        } else {
            String::new()
        };
        let left = self.step_limit.saturating_sub(step);
        let to_go = if step > 0 && self.step_limit > 0 {
            format!(", {} to go", output::time(seconds / step as f64 * left as f64))
        } else {
            String::new()
        };
        format!(
            "nappe: step {}{of}, t = {}, after {}{to_go}",
            output::count(step),
            output::moment(time),
            output::time(seconds)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_due_after_every_interval_and_none_before() {
        let begin = Instant::now();
        let at = |seconds: f64| begin + Duration::from_secs_f64(seconds);
        let pace = Pace::new(4000, Duration::from_secs(10), begin);
        assert_eq!(pace.line(at(9.9)), None);
        assert_eq!(pace.wait(at(9.0)), Duration::from_secs(1));
        // A first step may take long.
        assert_eq!(pace.line(at(10.0)).as_deref(), Some("nappe: step 0 of 4 000, t = 0.000 s, after 10.0 s"));
        pace.see(1000, 2.5);
        assert_eq!(pace.line(at(19.9)), None);
        let line = pace.line(at(20.0));
        assert_eq!(
            line.as_deref(),
            Some("nappe: step 1 000 of 4 000, t = 2.500 s, after 20.0 s, 60.0 s to go")
        );
        assert_eq!((pace.line(at(20.0)), pace.wait(at(40.0))), (None, Duration::ZERO));
    }

    #[test]
    fn without_an_end_nothing_is_to_go() {
        let begin = Instant::now();
        let pace = Pace::new(0, Duration::from_millis(1), begin);
        pace.see(7, 0.07);
        let line = pace.line(begin + Duration::from_secs(2));
        assert_eq!(line.as_deref(), Some("nappe: step 7, t = 0.070 s, after 2.00 s"));
    }
}
