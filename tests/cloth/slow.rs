//! What takes long of cloth: the shipped scenes over most of what they show, and without each of their terms; contact with itself;
//! solids of many parts.
//! `shipped.rs` looks at how scenes begin.

mod scenes;
mod bounces;
mod animals;
mod surface_slow;
mod drape;
mod resolution;
mod strips;
mod bent_strips;
mod rippled;
mod random_unions;
mod mannequin;
mod hands;
mod sleep;

use nappe_scene::{NoMeshes, Scene, SceneLimits, shipped_scenes};
use nappe_sim::{math::Precision, report::NoStopwatch, world::Simulation};
use nappe_tests::threads::with_threads;

use crate::bounces::bounces_fall_by_the_square_of_their_restitution;
use crate::hands::random_pulls_fail_nothing;
use crate::mannequin::Fall;
use crate::random_unions::{Counts, distances_are_those_of_unions};
use crate::rippled::{a_rippled_sheet_converges, a_squeezed_sheet_buckles};
use crate::scenes::scenes_run_keep_their_pins_and_gain_no_energy;
use crate::sleep::{all, is_off_by_no_more_than_is_told};

#[test]
fn what_sleeps_is_off_by_no_more_than_is_told_for_three_errors() {
    for compared in all() {
        for precision in Precision::ALL {
            for error in [1e-4, 3e-4, 1e-3] {
                is_off_by_no_more_than_is_told(&compared, error, precision);
            }
        }
    }
}

#[test]
fn every_shipped_scene_runs_keeps_its_pins_and_gains_no_energy() {
    with_threads(0, || scenes_run_keep_their_pins_and_gain_no_energy(&Precision::ALL, 300_000));
}

#[test]
fn every_shipped_scene_takes_a_step_without_each_of_its_terms() {
    with_threads(0, || {
        for (name, text) in shipped_scenes() {
            let scene = Scene::parse(text, name).unwrap_or_else(|error| panic!("{error}"));
            // Half of the digits are a term too.
            let scene = Scene { precision: Precision::F64, ..scene };
            let terms = scene.terms();
            assert!(!terms.is_empty(), "{name}");
            let each = terms.iter().map(|term| vec![term.removal]);
            let all = terms.iter().map(|term| term.removal).collect();
            for removals in each.chain([all]) {
                let left = scene.without(&removals);
                let built = left
                    .build(&NoMeshes, &SceneLimits::default())
                    .unwrap_or_else(|error| panic!("{name} without {removals:?}: {error}"));
                let (mut simulation, _) = Simulation::new(&built.setup, left.precision)
                    .unwrap_or_else(|error| panic!("{name} without {removals:?}: {error}"));
                simulation.apply(&built.initial_changes).expect("changes of a scene that is shipped");
                let taken = simulation.step(&mut NoStopwatch);
                taken.unwrap_or_else(|error| panic!("{name} without {removals:?}: {error}"));
            }
        }
    });
}

#[test]
fn bounces_of_100_seconds_fall_by_the_square_of_their_restitution_and_come_to_rest_in_time() {
    for dt in [0.01, 0.005, 0.001] {
        bounces_fall_by_the_square_of_their_restitution(dt, 100.0);
    }
}

#[test]
fn newtons_method_ends_in_every_step_of_a_rippled_sheet() {
    a_rippled_sheet_converges([150, 130], 8, 25);
}

#[test]
fn a_hand_that_pulls_200_times_at_random_fails_nothing() {
    for name in ["hanging_sheet", "flag", "towel"] {
        with_threads(0, || random_pulls_fail_nothing(name, 200));
    }
}

#[test]
fn a_large_sheet_buckles_in_waves_as_long_as_itself() {
    a_squeezed_sheet_buckles(120, 0.07);
}

#[test]
fn the_distance_from_up_to_fifty_parts_that_overlap_is_that_from_their_union() {
    let counts = distances_are_those_of_unions(1_000, 50, 1_000);
    let Counts { inside, outside, shared } = counts;
    assert!(inside > 50_000 && outside > 50_000 && shared > 20_000, "{counts:?}");
}

#[test]
#[allow(clippy::print_stdout, reason = "figures beside the limits")]
fn a_sheet_that_covers_a_mannequin_rests_on_a_mesh_of_thirty_capsules_as_on_the_capsules() {
    with_threads(0, || {
        let fall = Fall { side: 48, spacing: 0.03, steps: 600 };
        let [particle, middle] = fall.rests_on_a_mesh_as_on_capsules();
        println!("{fall:?}: particles are {particle:e} m apart at most, and the middles {middle:e} m");
    });
}
