//! What references of little work claim, checked by one of more work on twelve scenes; a lie, claims that are halved, is seen.

use nappe_sim::cloth::Network;
use nappe_study::{Budget, Case, Effort, Reference, Times, reference};
use nappe_tests::networks::{sheet, sheet_rules};
use rayon::prelude::*;

use crate::support::case;

const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];
const DT: f64 = 0.005;
const END: f64 = 32.0 * DT;
/// Longest steps (s) of first runs: they resolve the fastest modes.
const STEP: f64 = 5e-4;
/// What rounding leaves (m).
const ROUNDING: f64 = 1e-12;
/// Times what both claim that references may be apart: what a run is off by is known to its order.
const APART: f64 = 1.25;

/// Particles along a side, stiffness (N/m), damping (N s/m), mass (kg) of a sheet that swings down from two corners, and its thickness (m).
const SHEETS: [(usize, f64, f64, f64, f64); 12] = [
    (5, 100.0, 0.01, 0.005, 0.0),
    (6, 50.0, 0.01, 0.005, 0.0),
    (7, 100.0, 0.0, 0.005, 0.0),
    (8, 20.0, 0.02, 0.004, 0.0),
    (9, 100.0, 0.05, 0.01, 0.0),
    (10, 80.0, 0.01, 0.006, 0.0),
    (11, 40.0, 0.005, 0.004, 0.0),
    (12, 60.0, 0.01, 0.005, 0.0),
    (13, 100.0, 0.02, 0.01, 0.0),
    (14, 50.0, 0.01, 0.005, 0.0),
    (5, 100.0, 0.01, 0.005, 0.004),
    (6, 50.0, 0.02, 0.005, 0.004),
];

/// References of a sheet: of two runs, which any wish is met by, of the first class of effort, and of the second.
fn references(case: &Case) -> [Reference; 3] {
    let times = Times::until(END, DT).expect("a multiple");
    let budget = Budget::new(None);
    [(f64::INFINITY, 0), (0.0, 0), (0.0, 1)].map(|(wanted, class)| {
        let effort = Effort::new(class).expect("a class");
        reference(case, &times, STEP, wanted, effort, &budget.until(1.0)).expect("a reference")
    })
}

/// How far two references are apart, over a share of what the first claims and all that the second does: the largest over all times.
fn apart(case: &Case, [rough, fine]: [&Reference; 2], share: f64) -> f64 {
    let ratio = |i: usize| {
        let claimed = share * rough.own_error[i] + fine.own_error[i];
        case.rms(&rough.states[i], &fine.states[i]) / (claimed + ROUNDING)
    };
    (0..fine.states.len()).map(ratio).fold(0.0, f64::max)
}

#[test]
fn what_little_work_claims_holds_by_more_and_halved_claims_are_found_out() {
    let of_scene = |(side, stiffness, damping, mass, thickness): &(usize, f64, f64, f64, f64)| {
        let network = sheet(*side, 0.05, &sheet_rules(*stiffness, *damping), *mass);
        let case = case(Network { thickness: *thickness, ..network }, GRAVITY, DT);
        let [two, small, fine] = references(&case);
        assert!(two.work.force_evaluations <= small.work.force_evaluations);
        assert!(small.work.force_evaluations < fine.work.force_evaluations);
        [1.0, 0.5].map(|share| {
            let of = |rough: &Reference| apart(&case, [rough, &fine], share);
            of(&two).max(of(&small))
        })
    };
    let found: Vec<[f64; 2]> = SHEETS.par_iter().map(of_scene).collect();
    let honest = found.iter().filter(|[ratio, _]| *ratio <= APART).count();
    assert_eq!(honest, SHEETS.len(), "apart over claimed, and over halved claims: {found:?}");
    let seen = found.iter().filter(|[_, lie]| *lie > APART).count();
    assert!(seen > 0, "halved claims pass: {found:?}");
}
