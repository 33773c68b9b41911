//! How fast what starts a hair away grows apart.

use nappe_study::{Budget, DISPLACEMENT, End, scan};
use nappe_tests::golden::Transient;

use crate::support::case;

#[test]
fn growth_is_that_of_the_golden_motions() {
    for name in Transient::ALL {
        let motion = Transient::named(name);
        let case = case(motion.network.network(), motion.network.gravity_m_s2, 0.1);
        let end = motion.states.iter().map(|state| state.t).fold(0.0, f64::max);
        let budget = Budget::new(None);
        let found = scan(&case, end, f64::INFINITY, None, &budget.until(1.0));
        assert_eq!(found.end, End::Reached);
        assert!(found.spread.len() >= 64, "{name}: {} times", found.spread.len());
        assert!(found.step <= 0.45 * found.bound, "{name}: {found:?}");
        for state in motion.states.iter().filter(|state| state.t > 0.0) {
            let place = (state.t / found.spacing).round() as usize - 1;
            let growth = found.spread[place] / DISPLACEMENT;
            // The golden growth is the largest of six trials; this is a mean over particles.
            assert!(
                (state.growth / 8.0..3.0 * state.growth).contains(&growth),
                "{name}, {} s: grown {growth} times, not {}",
                state.t,
                state.growth
            );
        }
    }
}
