//! Sheets that fall on a ball and sheets in a pile cross nowhere, and a pile keeps its gaps.

use nappe_tests::surface::{Case, Tally, Watched, on_a_ball, piled};

#[test]
fn three_sheets_that_fall_on_a_ball_cross_nowhere() {
    for case in Case::SMOOTH {
        let scene = on_a_ball([3, 13], [0.03, 0.1], 4e-3, &case);
        let mut watched = Watched::new(&scene, case.precision);
        watched.go(250);
        assert_eq!(watched.tally.complaint(), None, "{case:?}");
    }
}

#[test]
fn sheets_in_a_pile_keep_more_than_two_fifths_of_their_thickness() {
    let thickness = 2e-3;
    for case in Case::SMOOTH {
        let mut watched = Watched::new(&piled([3, 10], thickness, &case), case.precision);
        watched.go(200);
        assert_eq!(watched.tally.complaint(), None, "{case:?}, the first second");
        watched.tally = Tally::default();
        watched.go(200);
        let tally = watched.tally;
        assert_eq!(tally.complaint(), None, "{case:?}, the second after it");
        assert!(tally.least_gap > 0.4 * thickness, "{case:?}: {tally:?}");
        assert_eq!(tally.rejected, 0, "{case:?}: {tally:?}");
    }
}
