//! Which frames a watcher gets, how often, and whether the session waits for it.

use std::time::Duration;

use tokio::time::{Interval, MissedTickBehavior};

/// Which frames a watcher gets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Delivery {
    /// The newest frame whenever the reader is ready.
    Latest {
        /// Least time between two frames; `None`: no limit.
        period: Option<Duration>,
    },
    /// Every frame from a number on.
    Every {
        /// The first frame; `None`: the newest.
        from_frame: Option<u64>,
        pace: Pace,
    },
}

/// Whether a session waits for a watcher of every frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pace {
    /// It does not: a watcher that falls behind what is kept ends.
    Session,
    /// It takes no step whose frame would take the place of one that the watcher needs.
    Watcher,
}

/// How often a watcher of the newest gets a frame.
#[derive(Debug)]
pub(super) struct Rate {
    /// None: as often as there is one.
    ticker: Option<Interval>,
    /// Whether the time of the next frame has come.
    is_time: bool,
}

impl Rate {
    /// At most one frame in each `period`.
    pub(super) fn new(period: Option<Duration>) -> Self {
        let ticker = period.map(|period| {
            let mut ticker = tokio::time::interval(period.max(Duration::from_micros(1)));
            ticker.set_missed_tick_behavior(MissedTickBehavior::Delay);
            ticker
        });
        Self { ticker, is_time: false }
    }

    /// Waits until the time of the next frame. Dropping the future loses nothing.
    pub(super) async fn ready(&mut self) {
        if let Some(ticker) = self.ticker.as_mut().filter(|_| !self.is_time) {
            ticker.tick().await;
        }
        self.is_time = true;
    }

    /// A frame was sent.
    pub(super) fn spend(&mut self) {
        self.is_time = false;
    }
}
