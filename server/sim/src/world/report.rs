//! What one step of the world tells: of one body, and of all together.

use crate::{
    linalg::SolveReport,
    report::{Diagnostics, SnowReport, StepReport},
};

/// What one step of the world tells of a body.
pub(super) struct BodyReport {
    /// Energies, momentum and stretch of the new state.
    pub(super) diagnostics: Diagnostics,
    /// What touched a collider in the body's last step: particles of cloth, nodes of snow.
    pub(super) contact_count: u64,
    /// The last linear solve; none where there is none.
    pub(super) solve: Option<SolveReport>,
    /// What only snow tells.
    pub(super) snow: Option<SnowReport>,
}

impl BodyReport {
    /// Adds what a body tells to the report of the world. Of several solves, the one with the larger
    /// residual is kept.
    pub(super) fn add_to(self, report: &mut StepReport) {
        report.diagnostics = report.diagnostics.with(&self.diagnostics);
        report.contact_count += self.contact_count;
        report.snow = self.snow.or(report.snow);

        let is_worse =
            |new: &SolveReport| report.solve.is_none_or(|old| new.relative_residual >= old.relative_residual);
        if let Some(solve) = self.solve.filter(is_worse) {
            report.solve = Some(solve);
        }
    }
}
