//! What one step of a cloth reports.

use crate::{
    linalg::SolveReport,
    report::{Diagnostics, ErrorEstimate, Notices, SurfaceReport, Work},
};

/// What the sub-steps of a cloth within one step of the world told.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ClothReport {
    /// Diagnostics of the new state, but for the work.
    pub(crate) diagnostics: Diagnostics,
    /// Work (J) of the air and given forces.
    pub(crate) external_work: f64,
    /// Particles that touched a collider, each once per sub-step in which it did.
    pub(crate) contact_count: u64,
    /// The linear solve with the largest residual of all sub-steps, with the iterations of all.
    pub(crate) solve: Option<SolveReport>,
    /// Linear solves of all sub-steps; 0 where nothing is solved.
    pub(crate) solves: u32,
    /// The largest error of all sub-steps.
    pub(crate) error: ErrorEstimate,
    /// Sub-steps of integrators that go on from the one before, without one.
    pub(crate) without_history: u32,
    /// What kept its surfaces apart; none where nothing has to, and nothing is counted.
    pub(crate) surface: Option<SurfaceReport>,
    /// What the user should know; particles in the user's numbering of the body.
    pub(crate) notices: Notices,
    /// What the sub-steps cost, and what was rejected.
    pub(crate) work: Work,
}
