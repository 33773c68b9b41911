//! What is known of a sub-step that is tried, and what it and those before it in the step tell.

use crate::{
    cloth::{
        contact::Count,
        evaluate::{Allowance, Common, Judged, PartSums, Start},
        layout::{Model, Yield},
        state::ClothReport,
    },
    collide::{Kept, Met},
    linalg::SolveReport,
    math::Real,
    report::SurfaceReport,
};

/// A sub-step that is tried.
#[derive(Clone, Debug, Default)]
pub(super) struct Attempt {
    /// What is known of the state that it starts from.
    pub(super) start: Start,
    /// Of implicit steps that are judged: what energy it may have, and whether that holds after contacts.
    pub(super) allowed: Option<Allowance>,
    pub(super) judged: Judged,
    /// What its parts do as a whole, and memory for that.
    pub(super) common: Common,
    pub(super) of_parts: PartSums,
    /// What it met, and what its contacts keep.
    pub(super) met: Met,
    pub(super) contacts: Kept,
    /// Memory of the count of crossings.
    pub(super) crossings: Count,
    /// What it tells, and what those before it in the step told.
    pub(super) tried: ClothReport,
    pub(super) report: ClothReport,
}

impl Attempt {
    /// Begins a step.
    pub(super) fn begin(&mut self) {
        self.report = ClothReport::default();
        self.contacts.begin();
    }

    /// Takes over how far corners of figures are off their frames at the end of the sub-step that is tried.
    pub(super) fn tell<R: Real>(&mut self, model: &Model<R>, off: &Yield) {
        let ClothReport { surface, notices, .. } = &mut self.tried;
        let tried = surface.unwrap_or_default();
        *surface = Some(SurfaceReport { yield_m: off.farthest, yielding: off.count, ..tried });
        notices.yielding_count = off.count;
        notices.first_yielding = off.first.map(|row| u64::from(model.user[row]));
    }

    /// Adds what an accepted sub-step has to tell.
    pub(super) fn add_to_report(&mut self) {
        let ClothReport {
            contact_count,
            solve,
            solves,
            error,
            without_history,
            notices,
            external_work,
            surface,
            ..
        } = self.tried;
        let report = &mut self.report;
        report.contact_count += contact_count;
        if contact_count > 0 {
            self.contacts.accept();
        }
        report.solves += solves;
        report.without_history += without_history;
        report.external_work += external_work;
        let with = |surface: SurfaceReport| report.surface.map_or(surface, |before| before.and(surface));
        report.surface = surface.map(with).or(report.surface);
        report.notices = report.notices.and(notices);
        report.error = report.error.max(error);
        let with = |solve: SolveReport| report.solve.map_or(solve, |others| others.and(solve));
        report.solve = solve.map(with);
    }
}
