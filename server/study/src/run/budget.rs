//! Seconds that a study may take, and a request to end it: what runs is then given up.

use std::{
    io,
    sync::{
        Arc, Condvar, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use nappe_sim::interrupt::Interrupt;

/// How often it is looked whether time is over.
const TICK: Duration = Duration::from_millis(5);

/// The seconds of a study. A thread of its own gives up what runs beyond them; it ends with this value.
#[derive(Debug)]
pub struct Budget {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// Ends a study from another thread.
#[derive(Clone, Debug)]
pub struct Stop(Arc<Shared>);

/// A part of a study, which ends at a time of its own.
#[derive(Clone, Debug)]
pub struct Phase {
    shared: Arc<Shared>,
    end: Option<Instant>,
}

/// Why something was not followed to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// Its time was over.
    Time,
    /// Somebody ended the study.
    Interrupted,
}

impl Cut {
    /// What tables and files say of it.
    pub const fn why(self) -> &'static str {
        match self {
            Self::Time => "out of time",
            Self::Interrupted => "interrupted",
        }
    }
}

/// A simulation that is given up when its phase is over, for as long as this value lives.
#[derive(Debug)]
pub(crate) struct Watched {
    shared: Arc<Shared>,
    interrupt: Interrupt,
}

#[derive(Debug)]
struct Shared {
    start: Instant,
    limit: Option<Duration>,
    is_stopped: AtomicBool,
    running: Mutex<Running>,
    ends: Condvar,
}

#[derive(Debug, Default)]
struct Running {
    /// What runs, and when it is given up.
    simulations: Vec<(Interrupt, Option<Instant>)>,
    is_over: bool,
}

impl Shared {
    fn running(&self) -> std::sync::MutexGuard<'_, Running> {
        // Each change of the list is whole.
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_stopped(&self) -> bool {
        self.is_stopped.load(Ordering::Relaxed)
    }

    /// Gives up what is beyond its time, until the budget is dropped.
    fn watch(&self) {
        let mut running = self.running();
        while !running.is_over {
            let (now, is_stopped) = (Instant::now(), self.is_stopped());
            let over = |end: &Option<Instant>| is_stopped || end.is_some_and(|end| now >= end);
            let late = running.simulations.iter().filter(|(_, end)| over(end));
            late.for_each(|(interrupt, _)| interrupt.request());
            running = self.ends.wait_timeout(running, TICK).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl Budget {
    /// As [`Self::start`].
    ///
    /// # Panics
    /// If the system starts no thread.
    pub fn new(limit: Option<Duration>) -> Self {
        Self::start(limit).expect("the system starts a thread")
    }

    /// Seconds from now on; none: as many as it takes.
    ///
    /// # Errors
    /// If the system starts no thread that looks at the time.
    pub fn start(limit: Option<Duration>) -> io::Result<Self> {
        let shared = Arc::new(Shared {
            start: Instant::now(),
            limit,
            is_stopped: AtomicBool::new(false),
            running: Mutex::default(),
            ends: Condvar::new(),
        });
        let watching = Arc::clone(&shared);
        let thread = Some(thread::Builder::new().spawn(move || watching.watch())?);
        Ok(Self { shared, thread })
    }

    /// What ends the study from another thread.
    pub fn stop(&self) -> Stop {
        Stop(Arc::clone(&self.shared))
    }

    /// Whether somebody ended the study.
    pub fn is_stopped(&self) -> bool {
        self.shared.is_stopped()
    }

    /// The part that ends when a share of all seconds is over.
    pub fn until(&self, share: f64) -> Phase {
        let end = self.shared.limit.map(|limit| self.shared.start + limit.mul_f64(share));
        Phase { shared: Arc::clone(&self.shared), end }
    }
}

impl Drop for Budget {
    fn drop(&mut self) {
        self.shared.running().is_over = true;
        self.shared.ends.notify_all();
        // A panic of that thread would have been an error of this file: nothing is left to be done about it.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

impl Stop {
    /// Ends the study, for good.
    pub fn stop(&self) {
        self.0.is_stopped.store(true, Ordering::Relaxed);
    }

    /// Seconds that are left; none without a budget.
    pub fn left(&self) -> Option<Duration> {
        self.0.limit.map(|limit| limit.saturating_sub(self.0.start.elapsed()))
    }
}

impl Phase {
    /// Whether its time is over, or the study was ended.
    pub(crate) fn is_over(&self) -> bool {
        self.shared.is_stopped() || self.end.is_some_and(|end| Instant::now() >= end)
    }

    /// Why what does not run to its end in it is given up.
    pub(crate) fn cut(&self) -> Cut {
        if self.shared.is_stopped() { Cut::Interrupted } else { Cut::Time }
    }

    /// Seconds that are left; infinite without a budget.
    pub(crate) fn left(&self) -> f64 {
        let left = |end: Instant| end.saturating_duration_since(Instant::now()).as_secs_f64();
        self.end.map_or(f64::INFINITY, left)
    }

    /// The same part, of which a share of the seconds that are left may be used.
    pub(crate) fn share(&self, share: f64) -> Self {
        let now = Instant::now();
        let end = self.end.map(|end| now + end.saturating_duration_since(now).mul_f64(share));
        Self { shared: Arc::clone(&self.shared), end }
    }

    /// Has a simulation given up when the time is over.
    pub(crate) fn watch(&self, interrupt: &Interrupt) -> Watched {
        self.shared.running().simulations.push((interrupt.clone(), self.end));
        Watched { shared: Arc::clone(&self.shared), interrupt: interrupt.clone() }
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        let mut running = self.shared.running();
        running.simulations.retain(|(interrupt, _)| !interrupt.is_same(&self.interrupt));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_runs_is_given_up_at_the_end_of_its_part_or_when_it_is_asked() {
        let budget = Budget::new(Some(Duration::from_millis(100)));
        let [early, late] = [Interrupt::default(), Interrupt::default()];
        let [first, second] = [budget.until(0.1), budget.until(1.0)];
        let watched = [first.watch(&early), second.watch(&late)];
        while !first.is_over() || !early.is_requested() {
            std::thread::yield_now();
        }
        while !late.is_requested() {
            std::thread::yield_now();
        }
        assert!(second.is_over() && second.left() == 0.0);
        drop(watched);
        assert!(budget.shared.running().simulations.is_empty());

        let endless = Budget::new(None);
        let asked = Interrupt::default();
        let phase = endless.until(0.5);
        let _watched = phase.watch(&asked);
        assert!(!phase.is_over() && phase.left().is_infinite());
        endless.stop().stop();
        while !asked.is_requested() {
            std::thread::yield_now();
        }
        assert!(phase.is_over() && endless.is_stopped());
    }
}
