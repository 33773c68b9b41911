//! Rings of cloth that are linked stay linked, and hang on each other.

use nappe_tests::surface::{Case, linked_rings};

/// The most (m) that the middles of two rings of 0.48 m can be apart while one hangs on the other, with some stretch.
const REACH: f64 = 0.32;

#[test]
fn rings_of_cloth_that_are_linked_stay_linked() {
    for case in Case::SMOOTH {
        let mut rings = linked_rings(3e-3, &case);
        let before = rings.links();
        assert_eq!(before.abs(), 1, "{case:?}: one through the other");
        for second in 1..=2 {
            rings.watched.go(150);
            let label = format!("{case:?}, after {} steps", 150 * second);
            assert_eq!(rings.watched.tally.complaint(), None, "{label}");
            assert_eq!(rings.links(), before, "{label}");
            let [upper, lower] = rings.heights();
            assert!((0.0..REACH).contains(&(upper - lower)), "{label}: at {upper} and {lower} m");
        }
    }
}

#[test]
fn rings_without_a_thickness_fall_out_of_each_other() {
    for case in Case::SMOOTH {
        let mut rings = linked_rings(0.0, &case);
        rings.watched.go(300);
        let [upper, lower] = rings.heights();
        assert!(upper - lower > 1.0, "{case:?}: at {upper} and {lower} m");
        assert_eq!(rings.links(), 0, "{case:?}");
    }
}
