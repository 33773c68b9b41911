//! What makes the results of a session doubtful: counts, and a sentence for the first of each kind. Rejected sub-steps
//! are counted, and told one by one elsewhere.
//!
//! Enters: the report of each step. Leaves: sums for diagnostics, and notices for watchers.

use nappe_proto::v1;
use nappe_sim::report::{Notices, StepReport};

/// A count before the step, what the step adds, and what is told of it.
type Kind = (u64, u64, fn(&StepReport) -> String);

/// The counts up to a step, and what happened in it for the first time.
pub(super) fn add(before: v1::Notices, report: &StepReport) -> (v1::Notices, Vec<String>) {
    let Notices { capped_solves, indefinite_solves, passed_count, pinched_count, .. } = report.notices;
    let rejected_steps = before.rejected_steps + report.rejections.len() as u64;
    let kinds: [Kind; 4] = [
        (before.capped_solves, capped_solves.into(), capped),
        (before.indefinite_solves, indefinite_solves.into(), indefinite),
        (before.passed_particles, passed_count, passed),
        (before.pinched_particles, pinched_count, pinched),
    ];
    let first =
        kinds.iter().filter(|(before, now, _)| *before == 0 && *now > 0).map(|(.., text)| text(report));

    let [capped_solves, indefinite_solves, passed_particles, pinched_particles] =
        kinds.map(|(before, now, _)| before + now);
    let counts =
        v1::Notices { capped_solves, indefinite_solves, passed_particles, rejected_steps, pinched_particles };
    (counts, first.collect())
}

fn capped(report: &StepReport) -> String {
    let residual = report.solve.map_or(f64::NAN, |solve| solve.relative_residual);
    let far = report.cloth.map_or(0.0, |cloth| cloth.error.of_solve);
    let far = if far > 0.0 { format!(", about {far:.1e} m off") } else { String::new() };
    format!(
        "step {}: the linear solver stopped at its largest number of iterations, above its tolerance (relative residual \
         {residual:.1e}{far}): allow more with max_iterations, or shorten dt",
        report.step
    )
}

fn indefinite(report: &StepReport) -> String {
    format!(
        "step {}: the linear solver met a matrix that is not positive definite, and the step goes as far as it came: \
         shorten dt, or choose hessian = \"absolute\" if it is another",
        report.step
    )
}

fn passed(report: &StepReport) -> String {
    let Notices { passed_count, first_passed, .. } = report.notices;
    format!(
        "step {}: particle {} went through a collider within one step, and {passed_count} in all: shorten dt, or choose \
         more substeps; for snow, lower safety or substep",
        report.step,
        first_passed.unwrap_or_default()
    )
}

fn pinched(report: &StepReport) -> String {
    let Notices { pinched_count, first_pinched, .. } = report.notices;
    format!(
        "step {}: particle {} is pinched between surfaces of a mesh collider that leave no place for its margin, and \
         {pinched_count} in all: lower margin, or make the gap wider than twice the margin",
        report.step,
        first_pinched.unwrap_or_default()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_told_once_and_counted_always() {
        let mut report = StepReport { step: 7, ..StepReport::default() };
        assert_eq!(add(v1::Notices::default(), &report), (v1::Notices::default(), Vec::new()));

        report.notices =
            Notices { capped_solves: 2, passed_count: 3, first_passed: Some(41), ..Notices::default() };
        let (counts, told) = add(v1::Notices::default(), &report);
        assert_eq!((counts.capped_solves, counts.indefinite_solves, counts.passed_particles), (2, 0, 3));
        assert_eq!(told.len(), 2);
        assert!(told.iter().all(|text| text.starts_with("step 7: ")), "{told:?}");
        assert!(told[1].contains("particle 41 ") && told[1].contains("3 in all"), "{told:?}");

        report.notices.indefinite_solves = 1;
        let (counts, told) = add(counts, &report);
        assert_eq!((counts.capped_solves, counts.indefinite_solves, counts.passed_particles), (4, 1, 6));
        assert!(told.len() == 1 && told[0].contains("positive definite"), "{told:?}");

        report.notices = Notices { pinched_count: 2, first_pinched: Some(5), ..Notices::default() };
        let (counts, told) = add(counts, &report);
        assert!(told.len() == 1 && told[0].contains("particle 5 is pinched"), "{told:?}");
        assert!(told[0].contains("2 in all"), "{told:?}");
        assert_eq!(add(counts, &report).0.pinched_particles, 4);
        assert!(add(counts, &report).1.is_empty());
    }
}
