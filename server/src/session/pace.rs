//! When the next step is due: as fast as possible, or tied to the wall clock.
//!
//! Reads monotonic instants that the caller passes. A step's due time is counted from the start of
//! the run, so that rounding does not accumulate. A session that is late by more than [`MAX_ARREARS`]
//! forgets the delay instead of racing to catch up.

use std::time::{Duration, Instant};

/// How far behind its clock a session may be and still catch up.
pub(crate) const MAX_ARREARS: Duration = Duration::from_millis(100);

/// Longest wait; after it, a longer one is computed again.
const MAX_WAIT: Duration = Duration::from_hours(1);

/// The pace of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    /// Simulated seconds per second of wall clock; 0: as fast as possible.
    factor: f64,
    /// Instant from which due times are counted.
    origin: Instant,
    /// Simulated time at `origin` (s).
    origin_time: f64,
}

impl Pace {
    /// A run that starts now at simulated `time` (s), with `factor` simulated seconds per second.
    pub(crate) fn start(factor: f64, now: Instant, time: f64) -> Self {
        Self { factor, origin: now, origin_time: time }
    }

    /// How long to wait before the step that ends at simulated time `end` (s). Forgets a delay that
    /// is too long.
    pub(crate) fn wait(&mut self, now: Instant, end: f64) -> Duration {
        if self.factor <= 0.0 {
            return Duration::ZERO;
        }

        let due_seconds = (end - self.origin_time) / self.factor;
        let elapsed = now.saturating_duration_since(self.origin).as_secs_f64();
        let wait = due_seconds - elapsed;

        if wait < -MAX_ARREARS.as_secs_f64() {
            self.origin = now;
            self.origin_time = end;
            return Duration::ZERO;
        }

        Duration::try_from_secs_f64(wait.max(0.0)).map_or(MAX_WAIT, |wait| wait.min(MAX_WAIT))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn due_times_do_not_drift() {
        let start = Instant::now();
        let mut pace = Pace::start(2.0, start, 1.0);
        for step in 1..=1000_u32 {
            // Steps of 10 ms at twice real time: one step every 5 ms of wall clock.
            let now = start + Duration::from_millis(u64::from(5 * step - 3));
            let wait = pace.wait(now, 1.0 + 0.01 * f64::from(step));
            assert!(wait.abs_diff(Duration::from_millis(3)) < Duration::from_micros(1), "{step}: {wait:?}");
        }
    }

    #[test]
    fn steps_as_long_as_a_frame_of_a_film_keep_their_rate_while_each_takes_less_than_its_time() {
        let start = Instant::now();
        let (frame, work) = (1.0 / 24.0, [0.035, 0.060, 0.020]);
        let (mut pace, mut now) = (Pace::start(1.0, start, 0.0), start);
        for step in 1..=240_u32 {
            now += pace.wait(now, f64::from(step) * frame);
            let due = start + Duration::from_secs_f64(f64::from(step) * frame);
            assert!(now + Duration::from_micros(1) >= due, "step {step} runs ahead of the clock");
            assert!(now.saturating_duration_since(due) < Duration::from_millis(20), "step {step} is late");
            now += Duration::from_secs_f64(work[step as usize % 3]);
        }
    }

    #[test]
    fn a_late_session_catches_up_only_within_the_bound() {
        let start = Instant::now();
        let mut pace = Pace::start(1.0, start, 0.0);

        // 50 ms late: goes on at once, and keeps its clock.
        assert_eq!(pace.wait(start + Duration::from_millis(60), 0.010), Duration::ZERO);
        assert_eq!(pace.wait(start + Duration::from_millis(60), 0.070).as_millis(), 10);

        // 10 s late: goes on at once, once, and then every 10 ms again.
        let late = start + Duration::from_secs(10);
        assert_eq!(pace.wait(late, 0.080), Duration::ZERO);
        assert!(pace.wait(late, 0.090) > Duration::from_millis(9));
    }

    #[test]
    fn factor_zero_never_waits_and_a_tiny_factor_waits_long() {
        let now = Instant::now();
        assert_eq!(Pace::start(0.0, now, 0.0).wait(now, 1e9), Duration::ZERO);
        assert_eq!(Pace::start(1e-300, now, 0.0).wait(now, 1.0), MAX_WAIT);
    }
}
