//! A thousand small clumps of snow over 20 000 sub-steps each.

use crate::clumps::worst_growth;

#[test]
fn a_thousand_clumps_of_snow_never_come_to_more_than_their_energy() {
    let halves = [0..500, 500..1000];
    let worst = std::thread::scope(|scope| {
        let runs = halves.map(|seeds| scope.spawn(|| worst_growth(seeds, 20_000)));
        runs.map(|run| run.join().expect("a half")).into_iter().fold(0.0, f64::max)
    });
    assert!(worst < 1.01, "{worst}");
}
