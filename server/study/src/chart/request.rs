//! What is asked of a chart.

use nappe_sim::math::Precision;

use crate::{case::Times, reference::Effort};

/// What is asked of a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Error that matters (m).
    pub tolerance: f64,
    /// The end of what is looked at (s): that of the scene, or an earlier one.
    pub end: f64,
    /// Steps after which the scene ends; 0: it has no end of its own.
    pub scene_steps: u64,
    /// Times that are asked for, in place of a window.
    pub times: Option<Times>,
    /// Names of methods; empty: all.
    pub methods: Vec<String>,
    /// Precisions in which every method runs.
    pub precisions: Vec<Precision>,
    /// The class of effort of the reference; none: the largest that the budget can pay.
    pub effort: Option<Effort>,
}
