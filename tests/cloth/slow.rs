//! The shipped scenes over most of what they show, which takes long. `shipped.rs` looks at how they begin.

mod scenes;

use nappe_sim::math::Precision;
use nappe_tests::threads::with_threads;

use crate::scenes::scenes_run_keep_their_pins_and_gain_no_energy;

#[test]
fn every_shipped_scene_runs_keeps_its_pins_and_gains_no_energy() {
    with_threads(0, || scenes_run_keep_their_pins_and_gain_no_energy(&Precision::ALL, 300_000));
}
