//! A sheet whose ends turn against each other crosses itself nowhere; without a thickness it does.

use nappe_tests::surface::{Case, twisted};

/// Turns, and steps.
const TWIST: [u32; 2] = [2, 300];

#[test]
fn a_sheet_that_is_twisted_by_two_turns_crosses_itself_nowhere() {
    for case in Case::SMOOTH {
        let mut watched = twisted(16, 0.02, 2e-3, TWIST, &case);
        watched.go(u64::from(TWIST[1]));
        assert_eq!(watched.tally.complaint(), None, "{case:?}");
    }
}

#[test]
fn a_sheet_without_a_thickness_crosses_itself_where_it_is_twisted() {
    for case in Case::SMOOTH {
        let mut watched = twisted(16, 0.02, 0.0, TWIST, &case);
        watched.go(u64::from(TWIST[1]));
        let tally = watched.tally;
        assert!(tally.crossings > 10 && tally.seen > 10, "{case:?}: {tally:?}");
    }
}
