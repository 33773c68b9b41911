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
    let Notices { yielding_count, torn_count, first_torn, .. } = report.notices;
    let rejected_steps = before.rejected_steps + report.rejections.len() as u64;
    let kinds: [Kind; 6] = [
        (before.capped_solves, capped_solves.into(), capped),
        (before.indefinite_solves, indefinite_solves.into(), indefinite),
        (before.passed_particles, passed_count, passed),
        (before.pinched_particles, pinched_count, pinched),
        (before.yielding_corners, yielding_count, yielding),
        (before.torn_particles, torn_count, torn),
    ];
    let first =
        kinds.iter().filter(|(before, now, _)| *before == 0 && *now > 0).map(|(.., text)| text(report));

    let [
        capped_solves,
        indefinite_solves,
        passed_particles,
        pinched_particles,
        yielding_corners,
        torn_particles,
    ] = kinds.map(|(before, now, _)| before + now);
    let counts = v1::Notices {
        capped_solves,
        indefinite_solves,
        passed_particles,
        rejected_steps,
        pinched_particles,
        yielding_corners,
        torn_particles,
        first_torn_particle: before.first_torn_particle.or(first_torn),
        first_torn_seconds: before.first_torn_seconds.or_else(|| first_torn.map(|_| report.time)),
    };
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

fn yielding(report: &StepReport) -> String {
    let Notices { yielding_count, first_yielding, .. } = report.notices;
    let farthest = report.surface.map_or(0.0, |surface| 1e3 * surface.yield_m);
    format!(
        "step {}: particle {}, a corner of a figure, is pressed more than 1 mm off its frame, and {yielding_count} in all, up to \
         {farthest:.1} mm at the end: where that is too far, raise firmness, or make frames that leave cloth more room",
        report.step,
        first_yielding.unwrap_or_default()
    )
}

fn torn(report: &StepReport) -> String {
    let Notices { torn_count, first_torn, .. } = report.notices;
    format!(
        "step {}, {:.4} s: particle {} of an elastic object is stretched farther than the cells of the grid can bear, and \
         {torn_count} in all: the object tears by numerics alone; fill it with more particles per cell, make cells larger or the \
         material stiffer, or attach it where it leaves a collider",
        report.step,
        report.time,
        first_torn.unwrap_or_default()
    )
}

#[cfg(test)]
mod tests {
    use nappe_sim::report::SurfaceReport;

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

        report.notices = Notices { yielding_count: 3, first_yielding: Some(8), ..Notices::default() };
        report.surface = Some(SurfaceReport { yield_m: 0.0172, ..SurfaceReport::default() });
        let (counts, told) = add(counts, &report);
        assert!(told.len() == 1 && told[0].contains("particle 8, a corner of a figure"), "{told:?}");
        assert!(told[0].contains("3 in all, up to 17.2 mm"), "{told:?}");
        assert_eq!(add(counts, &report).0.yielding_corners, 6);
        assert!(add(counts, &report).1.is_empty());
        (report.step, report.time) = (9, 0.45);
        report.notices = Notices { torn_count: 3, first_torn: Some(8), ..Notices::default() };
        let (counts, told) = add(counts, &report);
        assert!(told.len() == 1 && told[0].starts_with("step 9, 0.4500 s: particle 8 "), "{told:?}");
        assert_eq!((counts.torn_particles, counts.first_torn_particle), (3, Some(8)));
        (report.step, report.time, report.notices.first_torn) = (10, 0.5, Some(2));
        let (counts, told) = add(counts, &report);
        assert!(told.is_empty(), "{told:?}");
        let first = (counts.first_torn_particle, counts.first_torn_seconds);
        assert_eq!((counts.torn_particles, first), (6, (Some(8), Some(0.45))));
    }
}
