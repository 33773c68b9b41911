//! What every suite prints of a measurement, and on how many threads it measures.

use serde::Serialize;

/// A measurement. These names are stable: scripts read them.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Row {
    /// Suite and case, `cloth/implicit_euler`.
    pub(crate) name: String,
    pub(crate) particles: usize,
    pub(crate) threads: usize,
    /// `f32` or `f64`.
    pub(crate) precision: &'static str,
    /// Median of what was timed: a step, a frame (s).
    pub(crate) median_seconds: f64,
    /// The fastest (s).
    pub(crate) min_seconds: f64,
    /// Work over the median, in `unit`.
    pub(crate) rate: f64,
    /// Unit of the rate, `steps/s`.
    pub(crate) unit: &'static str,
}

/// One thread and all of them; one measurement on a machine with one core.
pub(crate) fn thread_counts(wanted: Option<u16>) -> Vec<usize> {
    let all = wanted.map_or_else(rayon::current_num_threads, usize::from);
    if all == 1 { vec![1] } else { vec![1, all] }
}
