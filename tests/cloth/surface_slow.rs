//! Cloth that keeps its surfaces apart, at full size, in both precisions, with and without friction, in three numberings.
//! `surface/` has the quick ones.
#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use nappe_scene::{NoMeshes, Scene as SceneFile, SceneLimits, shipped_scenes};
use nappe_sim::{cloth::SurfaceCheck, math::Precision};
use nappe_tests::{
    Scene,
    numbering::renumbered,
    scene::{max_distance, positions},
    surface::{
        Case, Folds, Tally, Watched, flung, folded_twice, on_a_ball, piled, pinched, speeds, twisted, walked,
    },
    threads::with_threads,
};

/// Prints what a run came to, and judges it.
fn judge(name: &str, case: &Case, tally: &Tally) {
    let per_step = tally.rounds as f64 / tally.steps as f64;
    println!("{name}, {case:?}: {per_step:.2} rounds a step, {tally:?}");
    assert_eq!(tally.complaint(), None, "{name}, {case:?}");
}

/// Runs a scene in a case, and judges it.
fn run(name: &str, scene: &Scene, steps: u64, case: &Case) -> Watched {
    let mut watched = Watched::new(scene, case.precision);
    watched.go(steps);
    judge(name, case, &watched.tally);
    watched
}

/// The cloth of a shipped scene, which keeps a thickness (m) whatever its file says.
fn shipped(name: &str, thickness: f64, case: &Case) -> (Scene, u64) {
    let (_, text) = shipped_scenes().iter().find(|(known, _)| *known == name).expect("it is shipped");
    let file = SceneFile::parse(text, name).unwrap_or_else(|error| panic!("{error}"));
    let built = file.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    let [body] = &built.setup.bodies[..] else { panic!("{name} has one body") };
    let network = renumbered(&body.network, &case.numbering.of(body.network.x.len()));
    let mut scene = Scene::new(network, built.setup.dt).under(built.setup.gravity);
    scene.network.thickness = thickness;
    scene.colliders.clone_from(&built.setup.colliders);
    scene.settings = body.settings;
    scene.settings.contact.friction = case.friction;
    scene.settings.contact.surface = SurfaceCheck::Count;
    (scene, file.steps)
}

#[test]
fn a_towel_of_40_x_40_that_is_folded_twice_and_let_go_crosses_itself_nowhere() {
    let folds = Folds { side: 40, spacing: 0.01, thickness: 2e-3, steps: [200, 80, 200] };
    with_threads(0, || {
        for case in Case::all() {
            judge("towel", &case, &folded_twice(&folds, &case));
        }
    });
}

#[test]
fn a_sheet_of_40_x_40_that_is_twisted_by_four_turns_crosses_itself_nowhere() {
    with_threads(0, || {
        // Four minutes each on two cores.
        for case in Case::SMOOTH.into_iter().chain(Case::ROUGH) {
            let mut watched = twisted(40, 0.02, 2e-3, [4, 800], &case);
            watched.go(800);
            judge("twist", &case, &watched.tally);
        }
    });
}

#[test]
fn five_sheets_that_fall_on_a_ball_cross_nowhere() {
    with_threads(0, || {
        for case in Case::all() {
            run("five sheets", &on_a_ball([5, 20], [0.02, 0.2], 2e-3, &case), 300, &case);
        }
    });
}

#[test]
fn three_sheets_that_fall_on_a_ball_cross_nowhere() {
    with_threads(0, || {
        for case in Case::all() {
            run("three sheets", &on_a_ball([3, 13], [0.03, 0.1], 4e-3, &case), 600, &case);
        }
    });
}

#[test]
fn the_cloth_of_cloth_over_sphere_crosses_itself_nowhere() {
    with_threads(0, || {
        for case in Case::all() {
            // It hangs about the ball in folds that do not touch: contact is looked for in each step, and none is found.
            let (scene, steps) = shipped("cloth_over_sphere", 6e-3, &case);
            let mut watched = Watched::new(&scene, case.precision);
            watched.go(steps);
            let tally = watched.tally;
            assert_eq!([tally.crossings, tally.seen, tally.rejected], [0; 3], "{case:?}: {tally:?}");
            assert_eq!([tally.told, tally.active], [steps, 0], "{case:?}: {tally:?}");
        }
    });
}

#[test]
fn the_cloth_of_the_demo_crosses_itself_nowhere() {
    with_threads(0, || {
        for case in Case::SMOOTH.into_iter().chain(Case::ROUGH) {
            let (scene, steps) = shipped("demo", 6e-3, &case);
            run("demo", &scene, steps, &case);
        }
    });
}

#[test]
fn five_hundred_sheets_that_are_flung_about_in_boxes_cross_themselves_nowhere() {
    let cases = Case::all();
    with_threads(0, || {
        let mut all = Tally::default();
        for seed in 0..500 {
            let case = cases[seed as usize % cases.len()];
            let mut watched = Watched::new(&flung(20, 2e-3, seed, &case), case.precision);
            watched.go(150);
            let tally = watched.tally;
            assert_eq!([tally.crossings, tally.seen], [0, 0], "seed {seed}, {case:?}: {tally:?}");
            all = all.and(tally);
        }
        println!("500 flung sheets: {all:?}");
        assert_eq!(all.complaint(), None);
    });
}

#[test]
fn five_sheets_on_a_table_come_to_rest_and_stay_where_they_are() {
    let thickness = 2e-3;
    with_threads(0, || {
        for case in Case::ROUGH {
            let scene = piled([5, 20], thickness, &case);
            let mut watched = run("a pile, the first second", &scene, 200, &case);
            watched.tally = Tally::default();
            watched.go(8_800);
            let before = positions(&watched.simulation);
            watched.go(1_000);
            let drift = max_distance(&before, &positions(&watched.simulation));
            let [all, vertical] = speeds(&watched.simulation, &scene.network.masses);
            println!("a pile: {all:e} m/s, {vertical:e} up and down, a drift of {drift:e} m");
            judge("a pile", &case, &watched.tally);
            assert!(watched.tally.least_gap > 0.4 * thickness, "{case:?}: {:?}", watched.tally);
            assert_eq!(watched.tally.rejected, 0, "{case:?}: {:?}", watched.tally);
            assert!(all < 1e-3 && vertical < 1e-4, "{case:?}: {all:e} m/s, {vertical:e} up and down");
            assert!(drift < 1e-3, "{case:?}: {drift:e} m in 1 000 steps");
        }
    });
}

#[test]
fn five_sheets_on_a_table_without_friction_keep_their_gaps() {
    let thickness = 2e-3;
    with_threads(0, || {
        for case in Case::SMOOTH {
            let mut watched = run("a smooth pile", &piled([5, 20], thickness, &case), 200, &case);
            watched.tally = Tally::default();
            watched.go(3_000);
            judge("a smooth pile", &case, &watched.tally);
            assert!(watched.tally.least_gap > 0.4 * thickness, "{case:?}: {:?}", watched.tally);
        }
    });
}

#[test]
fn plates_of_500_corners_that_go_into_each_other_give_way_to_a_sheet_take_it_along_and_let_it_go() {
    with_threads(0, || {
        for precision in Precision::ALL {
            let came_to = pinched(12, 16, precision);
            println!("plates in {precision}: {came_to:?}");
            assert_eq!(came_to.complaint(precision), None);
        }
    });
}

#[test]
fn the_walker_walks_five_seconds_in_its_tunic_and_no_cloth_crosses_anything() {
    with_threads(0, || {
        for precision in Precision::ALL {
            for friction in [0.0, 0.3] {
                let came_to = walked(precision, friction, 1000);
                println!("walker in {precision}, friction {friction}: {came_to:?}");
                assert_eq!(came_to.complaint(), None);
                assert!(came_to.yields.0 > 1e-3, "its arms press nothing: {came_to:?}");
            }
        }
    });
}
