//! When to try again after a broken connection, and how long to wait.
//!
//! Enters: the number of failures in a row. Leaves: a delay, or the decision to give up.

use std::time::Duration;

/// How a stream of frames comes back after the connection broke or the server was away.
///
/// The wait doubles after each failure in a row, from `first_delay` up to `max_delay`, and each wait is drawn
/// between half of that and all of it, so that watchers of a restarted server do not come back together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReconnectPolicy {
    /// Attempts in a row before giving up; 0: never try again.
    pub max_attempts: u32,
    /// Wait before the first attempt.
    pub first_delay: Duration,
    /// Longest wait before an attempt.
    pub max_delay: Duration,
    /// How long nobody may listen at the address before giving up: sessions do not outlive their server.
    pub refused_limit: Duration,
}

impl Default for ReconnectPolicy {
    /// Ten attempts in a row, 0.1 s to 5 s apart, and 2 s where nobody listens.
    fn default() -> Self {
        Self {
            max_attempts: 10,
            first_delay: Duration::from_millis(100),
            max_delay: Duration::from_secs(5),
            refused_limit: Duration::from_secs(2),
        }
    }
}

impl ReconnectPolicy {
    /// The first failure ends the stream.
    pub fn never() -> Self {
        Self { max_attempts: 0, ..Self::default() }
    }

    /// How long to wait after `failures` in a row (1 is the first), or `None` to give up.
    /// `draw` is uniform in 0 to 1.
    pub(crate) fn delay(&self, failures: u32, draw: f64) -> Option<Duration> {
        if failures > self.max_attempts {
            return None;
        }
        let doublings = failures.saturating_sub(1).min(31);
        let longest = self.first_delay.saturating_mul(1 << doublings).min(self.max_delay);
        Some(longest.mul_f64(0.5 + 0.5 * draw.clamp(0.0, 1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_up_to_the_longest_and_attempts_end() {
        let policy = ReconnectPolicy {
            max_attempts: 4,
            first_delay: Duration::from_millis(100),
            max_delay: Duration::from_millis(350),
            ..ReconnectPolicy::default()
        };
        let waits: Vec<_> = (1..=5).map(|failures| policy.delay(failures, 1.0)).collect();
        let millis = |count| Some(Duration::from_millis(count));
        assert_eq!(waits, [millis(100), millis(200), millis(350), millis(350), None]);
    }

    #[test]
    fn a_wait_is_never_below_half_nor_above_the_whole() {
        let policy = ReconnectPolicy::default();
        for failures in 1..=policy.max_attempts {
            let (low, high) = (policy.delay(failures, 0.0), policy.delay(failures, 1.0));
            assert_eq!(low.map(|wait| wait * 2), high);
        }
    }

    #[test]
    fn a_huge_count_of_failures_does_not_overflow() {
        let policy = ReconnectPolicy { max_attempts: u32::MAX, ..ReconnectPolicy::default() };
        assert_eq!(policy.delay(u32::MAX, 1.0), Some(policy.max_delay));
    }
}
