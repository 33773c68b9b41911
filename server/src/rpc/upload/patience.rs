//! How long an upload may take: in all, between two pieces, and for the bytes that have come.

use std::time::Duration;

use tokio::time::Instant;

use crate::error::{Reason, ServiceError};

/// Time that every upload has before its rate counts.
const GRACE: Duration = Duration::from_secs(10);

/// Bounds on the time of an upload.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UploadTimes {
    /// The longest pause between two pieces.
    pub(crate) idle: Duration,
    /// The longest time in all.
    pub(crate) whole: Duration,
    /// Bytes per second at least, once the first seconds are over; 0: any.
    pub(crate) least_rate: u64,
}

/// Why an upload is given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lapse {
    Idle,
    Whole,
    Rate,
}

impl UploadTimes {
    /// Until when the next piece of an upload that began at `start` has to come, if the last one came at
    /// `now`, and what it breaks otherwise.
    pub(super) fn patience(&self, start: Instant, now: Instant, received: usize) -> (Instant, Lapse) {
        let idle = (now + self.idle, Lapse::Idle);
        let whole = (start + self.whole, Lapse::Whole);
        let seconds = received as f64 / self.least_rate as f64;
        let rate =
            Duration::try_from_secs_f64(seconds).map_or(whole, |paid| (start + GRACE + paid, Lapse::Rate));
        [whole, rate].into_iter().fold(idle, |first, other| if other.0 < first.0 { other } else { first })
    }

    /// The error of an upload that broke a bound.
    pub(super) fn error(&self, lapse: Lapse, received: usize) -> ServiceError {
        match lapse {
            Lapse::Idle => {
                let seconds = self.idle.as_secs_f64();
                let message = format!("no piece came within {seconds} s: the upload is forgotten");
                ServiceError::new(Reason::UploadTimedOut, message).with("seconds", seconds)
            }
            Lapse::Whole => {
                let seconds = self.whole.as_secs_f64();
                let message = format!("the upload did not end within {seconds} s: it is forgotten");
                ServiceError::new(Reason::UploadTimedOut, message).with("seconds", seconds)
            }
            Lapse::Rate => {
                let (rate, grace) = (self.least_rate, GRACE.as_secs());
                let message = format!(
                    "{received} bytes came; allowed: at least {rate} bytes per second after the first {grace} s"
                );
                ServiceError::new(Reason::UploadTooSlow, message)
                    .with("bytes", received)
                    .with("bytes_per_second", rate)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMES: UploadTimes =
        UploadTimes { idle: Duration::from_secs(30), whole: Duration::from_mins(10), least_rate: 64_000 };

    #[test]
    fn bytes_buy_time_until_the_deadline() {
        let start = Instant::now();
        let patience = |times: UploadTimes, seconds, received| {
            let (until, lapse) = times.patience(start, start + Duration::from_secs(seconds), received);
            ((until - start).as_secs(), lapse)
        };
        assert_eq!(patience(TIMES, 0, 0), (10, Lapse::Rate));
        assert_eq!(patience(TIMES, 0, 640_000), (20, Lapse::Rate));
        assert_eq!(patience(TIMES, 0, 6_400_000), (30, Lapse::Idle));
        assert_eq!(patience(TIMES, 590, 64_000_000), (600, Lapse::Whole));
        assert_eq!(patience(TIMES, 590, 6_400_000), (110, Lapse::Rate), "it is too late");
        assert_eq!(patience(UploadTimes { least_rate: 0, ..TIMES }, 590, 0), (600, Lapse::Whole));
    }
}
