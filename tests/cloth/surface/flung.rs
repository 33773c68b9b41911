//! Sheets that are flung about in boxes cross themselves nowhere; without a thickness they do.

use nappe_tests::{
    surface::{Case, Tally, Watched, flung},
    threads::with_threads,
};

const SIDE: usize = 16;

/// Steps in which a sheet folds, meets walls and falls to the floor.
const STEPS: u64 = 120;

/// What runs over some seeds come to.
fn all(seeds: std::ops::Range<u64>, thickness: f64, cases: &[Case]) -> Tally {
    let run = |seed: u64| {
        let case = cases[seed as usize % cases.len()];
        let mut watched = Watched::new(&flung(SIDE, thickness, seed, &case), case.precision);
        watched.go(STEPS);
        watched.tally
    };
    with_threads(0, || seeds.map(run).fold(Tally::default(), Tally::and))
}

#[test]
fn twenty_sheets_that_are_flung_about_in_boxes_cross_themselves_nowhere() {
    assert_eq!(all(0..20, 2e-3, &Case::SMOOTH).complaint(), None);
}

#[test]
fn sheets_without_a_thickness_cross_themselves_where_they_are_flung() {
    let tally = all(0..3, 0.0, &Case::SMOOTH);
    assert!(tally.crossings > 10 && tally.seen > 10, "{tally:?}");
}
