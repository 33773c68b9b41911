//! What is asked of a chart.

use nappe_sim::math::Precision;

use crate::times::Times;

/// What is asked of a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Error that matters (m).
    pub tolerance: f64,
    /// The end of the scene as it is written (s).
    pub end: f64,
    /// Times that are asked for, in place of a window.
    pub times: Option<Times>,
    /// Names of methods; empty: all.
    pub methods: Vec<String>,
    /// Precisions in which every method runs.
    pub precisions: Vec<Precision>,
}
