//! What one step of the world tells: of one body, and of all together.

use crate::{
    linalg::SolveReport,
    report::{Diagnostics, Notices, SnowReport, StepReport, SurfaceReport, Work},
};

/// What one step of the world tells of a body.
pub(crate) struct BodyReport {
    /// Energies, momentum and stretch of the new state.
    pub(crate) diagnostics: Diagnostics,
    /// What touched a collider: particles of cloth, once per sub-step; nodes of snow, in its last sub-step.
    pub(crate) contact_count: u64,
    /// The worst linear solve of cloth, the last one of snow; none where there is none.
    pub(crate) solve: Option<SolveReport>,
    /// What kept the surfaces of a cloth apart.
    pub(crate) surface: Option<SurfaceReport>,
    /// What only snow tells.
    pub(crate) snow: Option<SnowReport>,
    /// What the user should know; particles over all bodies.
    pub(crate) notices: Notices,
    pub(crate) work: Work,
}

impl BodyReport {
    /// Adds what a body tells to the report of the world. Of several solves, the one with the larger
    /// residual is kept.
    pub(crate) fn add_to(self, report: &mut StepReport) {
        report.diagnostics = report.diagnostics.with(&self.diagnostics);
        report.contact_count += self.contact_count;
        report.surface = self.surface.into_iter().chain(report.surface).reduce(SurfaceReport::with);
        report.snow = self.snow.or(report.snow);
        report.notices = report.notices.and(self.notices);
        report.work = report.work.and(self.work);

        let is_worse = |new: &SolveReport| {
            report.solve.is_none_or(|old| new.relative_residual.total_cmp(&old.relative_residual).is_ge())
        };
        if let Some(solve) = self.solve.filter(is_worse) {
            report.solve = Some(solve);
        }
    }
}
