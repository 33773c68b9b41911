//! A linear solve as settings ask for it: conjugate gradient with the preconditioner that they name.

use super::{
    cg::{CgWorkspace, conjugate_gradient},
    coarse::{CoarseLayout, CoarseMatrix},
    operator::{LinearOperator, Preconditioner},
    patches::{PatchLayout, PatchMatrix, Patches},
    precondition::{BlockJacobi, Identity, Inverse3},
    settings::{Outcome, PreconditionerKind, SolveReport, SolverSettings},
    two_level::TwoLevel,
};
use crate::{
    math::{Real, Sixteen},
    parallel::Share,
};

/// A linear system, with what preconditioners are made of.
#[derive(Clone, Copy)]
pub(crate) struct System<'a, R: Real> {
    pub(crate) operator: &'a dyn LinearOperator<R>,
    /// The right-hand side, in rows as `x`.
    pub(crate) b: &'a [Sixteen<R>],
    /// Inverses of the diagonal blocks, of the kind that the settings name.
    pub(crate) inverse: &'a [Inverse3],
    /// The coarse space and the matrix on it; of a preconditioner that has one.
    pub(crate) coarse: Option<(&'a CoarseLayout, &'a CoarseMatrix)>,
    /// Patches that were set up; of a preconditioner that has them.
    pub(crate) patches: Option<(&'a PatchLayout, &'a PatchMatrix)>,
}

/// Solves a system for `x`, of which `begin` writes the first guess where a solve starts warm. Where a coarse space fails, since of an indefinite matrix it
/// may be indefinite where the inverse diagonal blocks are not, the solve begins again without it.
///
/// # Panics
/// If the settings name a preconditioner with a coarse space, and the system has none.
pub(crate) fn solve<R: Real>(
    system: &System<'_, R>,
    x: &mut [Sixteen<R>],
    begin: &dyn Fn(&mut [Sixteen<R>]),
    settings: &SolverSettings,
    share: &Share,
    work: &mut CgWorkspace<R>,
) -> SolveReport {
    let System { operator, b, inverse, coarse, patches } = *system;
    let jacobi = BlockJacobi(inverse);
    let mut run = |preconditioner: &dyn Preconditioner<R>| {
        begin(x);
        conjugate_gradient(operator, preconditioner, b, x, settings, share, work)
    };
    let report = match settings.preconditioner {
        PreconditionerKind::Identity => run(&Identity),
        PreconditionerKind::Diagonal | PreconditionerKind::BlockJacobi | PreconditionerKind::Auto => {
            run(&jacobi)
        }
        PreconditionerKind::TwoLevel => {
            let (layout, matrix) = coarse.expect("laid out for these settings");
            let report = run(&TwoLevel::new(inverse, layout, matrix));
            if is_unfit(report.outcome) { run(&jacobi).beside(report) } else { report }
        }
        PreconditionerKind::Patches => {
            let (layout, matrix) = patches.expect("laid out for these settings");
            let report = run(&Patches::new(inverse, layout, matrix));
            if is_unfit(report.outcome) { run(&jacobi).beside(report) } else { report }
        }
    };
    SolveReport { preconditioner: Some(settings.preconditioner), ..report }
}

/// Whether a preconditioner with a coarse space failed.
fn is_unfit(outcome: Outcome) -> bool {
    matches!(outcome, Outcome::IndefinitePreconditioner { .. } | Outcome::NotFinite { iteration: 0 })
}
