//! A towel that is folded twice and let go crosses itself nowhere.

use nappe_tests::surface::{Case, Folds, folded_twice};

/// A small towel that is folded quickly.
const SMALL: Folds = Folds { side: 16, spacing: 0.01, thickness: 2e-3, steps: [100, 40, 60] };

#[test]
fn a_towel_that_is_folded_twice_and_let_go_crosses_itself_nowhere() {
    for case in Case::SMOOTH {
        let tally = folded_twice(&SMALL, &case);
        assert_eq!(tally.complaint(), None, "{case:?}");
    }
}
