//! The shipped scenes over most of what they show, which takes long. `shipped.rs` looks at how they begin.

mod scenes;
mod bounces;

use nappe_sim::math::Precision;
use nappe_tests::threads::with_threads;

use crate::bounces::bounces_fall_by_the_square_of_their_restitution;
use crate::scenes::scenes_run_keep_their_pins_and_gain_no_energy;

#[test]
fn every_shipped_scene_runs_keeps_its_pins_and_gains_no_energy() {
    with_threads(0, || scenes_run_keep_their_pins_and_gain_no_energy(&Precision::ALL, 300_000));
}

#[test]
fn bounces_of_100_seconds_fall_by_the_square_of_their_restitution_and_come_to_rest_in_time() {
    for dt in [0.01, 0.005, 0.001] {
        bounces_fall_by_the_square_of_their_restitution(dt, 100.0);
    }
}
