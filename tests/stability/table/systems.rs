//! Linear systems on which solvers fail.

use nappe_sim::linalg::{Outcome, PreconditionerKind, Stop};
use nappe_study::{Verdict, gallery::Finding};
use nappe_tests::systems::System;

use super::markdown::table as markdown;

const SYSTEMS: [(&str, &str); 6] = [
    ("21. a right-hand side of 0", "spd_rhs_zero"),
    ("22. a curvature of exactly 0", "breakdown_exact_zero"),
    ("23. indefinite, which its right-hand side does not show", "indef_benign_rhs"),
    ("24. negative curvature in the first iteration", "indef_first_iteration"),
    ("24. negative curvature in a later one", "indef_tetra_compressed"),
    ("25. singular, without a solution", "singular_inconsistent"),
];
const KINDS: [PreconditionerKind; 3] =
    [PreconditionerKind::Identity, PreconditionerKind::Diagonal, PreconditionerKind::BlockJacobi];

pub(super) fn table(lost: &mut Vec<String>) -> String {
    let head: Vec<_> =
        std::iter::once("system".to_owned()).chain(KINDS.map(|kind| format!("`{}`", kind.name()))).collect();
    let rows: Vec<_> = SYSTEMS
        .iter()
        .map(|(what, name)| {
            let findings = KINDS.map(|kind| find(&System::named(name), kind));
            let is_lost = |found: &&Finding| found.verdict == Verdict::Lost;
            lost.extend(findings.iter().filter(is_lost).map(|found| format!("{what}: {found}")));
            std::iter::once((*what).to_owned()).chain(findings.map(|found| found.to_string())).collect()
        })
        .collect();
    markdown(&head, &rows)
}

fn find(system: &System, kind: PreconditionerKind) -> Finding {
    let stop = Stop::Residual { tolerance: 1e-12, max_iterations: 200 };
    let (report, x) = system.solve::<f64>(kind, stop);
    if !x.iter().all(|c| c.is_finite()) {
        return Finding::new(Verdict::Lost, "not finite");
    }
    if report.outcome != Outcome::Converged {
        return Finding::new(Verdict::Detected, report.outcome.to_string());
    }
    let is_zero = system.b.iter().all(|b| *b == 0.0);
    let residual = if is_zero { x.iter().map(|c| c.abs()).sum() } else { system.residual(&x) };
    Finding::new(Verdict::Survived, format!("{} iterations", report.iterations))
        .only_if(|| residual < 1e-9, || format!("a residual of {residual:.1e}"))
}
