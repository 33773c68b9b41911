//! Lines that tell how far a simulation is, for a file or a pipe: one after each interval, and none before the first is over.
//!
//! Enters: steps as they are taken, and instants. Leaves: lines.

use std::{
    cell::Cell,
    time::{Duration, Instant},
};

use crate::words::output;

/// For how long steps count at least for the time that is left; at most for twice as long.
const RECENT: Duration = Duration::from_secs(30);

/// A step that was taken, and when.
#[derive(Clone, Copy, Debug)]
struct Mark {
    step: u64,
    at: Instant,
}

/// How far a simulation is, and when that is told next.
#[derive(Debug)]
pub(crate) struct Pace {
    /// Steps to the end; 0: it has none.
    step_limit: u64,
    interval: Duration,
    begin: Mark,
    /// Where the steps begin that count for the time that is left, and where those will begin that count later.
    recent: Cell<[Mark; 2]>,
    /// When the next line is due.
    due: Cell<Instant>,
    /// The last step that is known of, and its time in the scene (s).
    reached: Cell<(u64, f64)>,
}

impl Pace {
    /// A simulation that has taken some steps of so many (0: it does not end by itself), and goes on now.
    pub(crate) fn new([step, step_limit]: [u64; 2], interval: Duration, now: Instant) -> Self {
        let begin = Mark { step, at: now };
        let (recent, due) = (Cell::new([begin; 2]), Cell::new(now + interval));
        Self { step_limit, interval, begin, recent, due, reached: Cell::new((step, 0.0)) }
    }

    /// Notes a step that is known of now, and its time in the scene (s).
    pub(crate) fn see(&self, step: u64, time: f64, now: Instant) {
        self.reached.set((step, time));
        let [_, later] = self.recent.get();
        if now.saturating_duration_since(later.at) >= RECENT {
            self.recent.set([later, Mark { step, at: now }]);
        }
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
        Some(self.told(now))
    }

    /// How far it is.
    fn told(&self, now: Instant) -> String {
        let (step, time) = self.reached.get();
        let of = if self.step_limit > 0 {
            format!(" of {}", output::count(self.step_limit))
        } else {
            String::new()
        };
        let to_go = match self.step_seconds(now).filter(|_| self.step_limit > 0) {
            Some(seconds) => {
                let left = self.step_limit.saturating_sub(step);
                format!(", {} to go", output::time(seconds * left as f64))
            }
            None => String::new(),
        };
        format!(
            "nappe: step {}{of}, t = {}, after {}{to_go}",
            output::count(step),
            output::moment(time),
            output::time(now.saturating_duration_since(self.begin.at).as_secs_f64())
        )
    }

    /// Seconds that a recent step took, if one was taken; else one of all.
    fn step_seconds(&self, now: Instant) -> Option<f64> {
        let (step, _) = self.reached.get();
        let [recent, _] = self.recent.get();
        let from = [recent, self.begin].into_iter().find(|mark| step > mark.step)?;
        Some(now.saturating_duration_since(from.at).as_secs_f64() / (step - from.step) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_due_after_every_interval_and_none_before() {
        let begin = Instant::now();
        let at = |seconds: f64| begin + Duration::from_secs_f64(seconds);
        let pace = Pace::new([0, 4000], Duration::from_secs(10), begin);
        assert_eq!(pace.line(at(9.9)), None);
        assert_eq!(pace.wait(at(9.0)), Duration::from_secs(1));
        // A first step may take long.
        assert_eq!(pace.line(at(10.0)).as_deref(), Some("nappe: step 0 of 4 000, t = 0.000 s, after 10.0 s"));
        pace.see(1000, 2.5, at(15.0));
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
        let pace = Pace::new([0, 0], Duration::from_millis(1), begin);
        pace.see(7, 0.07, begin);
        let line = pace.line(begin + Duration::from_secs(2));
        assert_eq!(line.as_deref(), Some("nappe: step 7, t = 0.070 s, after 2.00 s"));
    }

    #[test]
    fn the_time_that_is_left_goes_by_recent_steps_and_not_by_those_before() {
        let begin = Instant::now();
        let at = |seconds: u64| begin + Duration::from_secs(seconds);
        // It goes on after 1 000 of 2 000 steps: a step each second, and then one in ten.
        let pace = Pace::new([1000, 2000], Duration::from_secs(1), begin);
        let left = |seconds: u64| {
            let line = pace.line(at(seconds)).expect("it is due");
            line.rsplit_once(", ").map(|(_, left)| left.to_owned())
        };
        assert_eq!(left(1).as_deref(), Some("after 1.00 s"));
        for second in 2..=100 {
            pace.see(998 + second, 0.0, at(second));
        }
        assert_eq!(left(100).as_deref(), Some("15.0 min to go"));
        for step in 1..=20 {
            pace.see(1098 + step, 0.0, at(100 + 10 * step));
        }
        assert_eq!(left(300).as_deref(), Some("2.45 h to go"));
        // A step that takes long counts while it lasts.
        assert_eq!(left(330).as_deref(), Some("4.90 h to go"));
    }
}
