//! What lies still: which pieces of a cloth count as calm, and from which step on, in motions in closed form; and what of that a
//! fork and a state that is put back go on with.

use std::sync::Arc;

use nappe_sim::{
    cloth::{Network, RestSettings},
    linalg::Stop,
    math::Precision,
    report::RestReport,
    world::{Change, Simulation},
};
use nappe_tests::{
    Scene,
    networks::{chain, particles, sheet, sheet_rules},
    scene::{advance, max_distance, positions},
};

/// Time step (s): a window of eight steps takes 0.08 s.
const DT: f64 = 0.01;
/// The rules divide 2e-4 m: a particle may go 2.5e-5 m within a window, and half of the change of its way may be 8e-7 m.
const REST: RestSettings = RestSettings { error: 1e-3, within: 10.0, sleep: false };
/// How far a particle of a calm piece may go within a window (m).
const WAY: f64 = 2.5e-5;

fn watched(network: Network) -> Scene {
    let mut scene = Scene::new(network, DT);
    scene.settings.rest = Some(REST);
    scene
}

/// A particle that falls freely.
fn falling(gravity: f64) -> Scene {
    watched(particles(&[[0.0; 3]], 1.0)).under([0.0, -gravity, 0.0])
}

/// What the last of so many steps tells.
fn told(simulation: &mut Simulation, steps: u64) -> RestReport {
    advance(simulation, steps).rest.expect("the cloth is watched")
}

/// The steps of the next so many, from 1, after which all of the cloth is calm.
fn calm_steps(simulation: &mut Simulation, steps: u64) -> Vec<u64> {
    (1..=steps).filter(|_| told(simulation, 1).calm_share() == 1.0).collect()
}

/// The whole numbers from one to another one, both included.
fn all(first: u64, last: u64) -> Vec<u64> {
    (first..=last).collect()
}

#[test]
fn what_does_not_move_is_calm_after_three_windows_of_eight_steps() {
    for precision in Precision::ALL {
        let scene = watched(chain(&[[0.0; 3], [0.125, 0.0, 0.0], [0.25, 0.0, 0.0]], 0.125, 10.0, 0.01, 0.01));
        assert_eq!(calm_steps(&mut scene.simulate(precision), 40), all(24, 40), "{precision}");
    }
}

#[test]
fn nothing_is_told_where_nothing_is_watched() {
    let scene = Scene::new(particles(&[[0.0; 3]], 1.0), DT);
    assert_eq!(advance(&mut scene.simulate(Precision::F64), 30).rest, None);
}

#[test]
fn pieces_are_what_springs_join_and_each_is_calm_by_itself() {
    let x: Vec<[f64; 3]> = (0..5).map(|i| [0.125 * f64::from(i), 0.0, 0.0]).collect();
    let mut network = chain(&x, 0.125, 10.0, 0.01, 0.01);
    // The last two are by themselves, and one of them goes by.
    network.springs.truncate(2);
    network.v[3] = [1.0, 0.0, 0.0];
    for precision in Precision::ALL {
        let RestReport { particles, calm_particles, pieces, calm_pieces, way, change, .. } =
            told(&mut watched(network.clone()).simulate(precision), 24);
        assert_eq!((particles, calm_particles, pieces, calm_pieces), (5, 4, 3, 2), "{precision}");
        assert!((way - 0.08).abs() < 1e-6 && change < 1e-6, "{precision}: {way:e} m, {change:e} m");
    }
}

#[test]
fn bodies_are_added_up() {
    let mut setup = watched(particles(&[[0.0; 3], [1.0, 0.0, 0.0]], 1.0)).setup();
    let mut other = setup.bodies[0].clone();
    other.name = "other".to_owned();
    other.network.v[1] = [0.0, 1.0, 0.0];
    setup.bodies.push(other);
    let (mut both, _) = Simulation::new(&setup, Precision::F64).expect("two bodies");
    let report = told(&mut both, 24);
    assert_eq!((report.particles, report.pieces), (4, 4));
    assert_eq!((report.calm_particles, report.calm_pieces), (3, 3));
}

#[test]
fn what_creeps_at_a_constant_speed_is_calm_once_its_way_does_not_change() {
    // 2e-5 m within each window, of which the first one changes by all of it.
    let mut network = particles(&[[0.0; 3]], 1.0);
    network.v[0] = [2.5e-4, 0.0, 0.0];
    for precision in Precision::ALL {
        let mut simulation = watched(network.clone()).simulate(precision);
        assert_eq!(calm_steps(&mut simulation, 48), all(32, 48), "{precision}");
        let way = told(&mut simulation, 8).way;
        assert!((way - 2e-5).abs() < 1e-9, "{precision}: {way:e} m");
    }
}

#[test]
fn what_is_slow_and_gets_faster_is_not_calm() {
    // From one window to the next a way changes by g (8 dt)², of which half is 1.6e-6 and 3.2e-7 m.
    for (gravity, calm) in [(5e-4, Vec::new()), (1e-4, all(24, 56))] {
        for precision in Precision::ALL {
            let mut simulation = falling(gravity).simulate(precision);
            assert_eq!(calm_steps(&mut simulation, 56), calm, "{gravity} m/s², {precision}");
            let RestReport { way, change, .. } = told(&mut simulation, 8);
            assert!(way < WAY, "{way:e} m");
            let expected = 0.5 * gravity * (8.0 * DT).powi(2);
            assert!((change - expected).abs() < 1e-3 * expected, "{precision}: {change:e} m, {expected:e}");
        }
    }
}

#[test]
fn a_pin_that_is_back_where_a_window_began_has_gone_there_and_back() {
    let mut network = particles(&[[0.0; 3], [1.0, 0.0, 0.0]], 1.0);
    network.pins = vec![0];
    let point = |i: u32| (4.0 * DT * f64::from(i), [0.0, if i % 2 == 1 { 0.01 } else { 0.0 }, 0.0]);
    let points: Arc<[(f64, [f64; 3])]> = (1..=12).map(point).collect();
    for precision in Precision::ALL {
        let mut simulation = watched(network.clone()).simulate(precision);
        let path = Change::PinPath { particle: 0, points: points.clone() };
        simulation.apply(&[path]).expect("a pin may follow a path");
        let RestReport { calm_pieces, way, change, .. } = told(&mut simulation, 48);
        assert_eq!(calm_pieces, 1, "{precision}: the free particle");
        assert!((way - 0.01).abs() < 1e-6 && change < 1e-6, "{precision}: {way:e} m, {change:e} m");
    }
}

#[test]
fn what_moved_again_needs_twice_as_many_windows_and_a_reset_forgets_that() {
    let scene = watched(particles(&[[0.0; 3]], 1.0));
    for precision in Precision::ALL {
        let mut simulation = scene.simulate(precision);
        assert_eq!(calm_steps(&mut simulation, 24), [24], "{precision}");
        let elsewhere =
            Change::State { body: "body".to_owned(), positions: [[1.0, 0.0, 0.0]].into(), velocities: None };
        simulation.apply(&[elsewhere]).expect("it may be put there");
        // The window that it is put within is judged at its end. In the next one its way changes back, and six follow.
        let calm: Vec<u64> = all(1, 7).into_iter().chain(all(64, 72)).collect();
        assert_eq!(calm_steps(&mut simulation, 72), calm, "{precision}");
        simulation.apply(&[Change::Reset]).expect("a world can be reset");
        assert_eq!(calm_steps(&mut simulation, 30), all(24, 30), "{precision}");
    }
}

#[test]
fn a_fork_and_a_state_that_is_put_back_tell_the_same() {
    let mut network = sheet(6, 0.1, &sheet_rules(100.0, 0.02), 0.01);
    network.drag = 0.05;
    let scene = watched(network).under([0.0, -9.81, 0.0]);
    for precision in Precision::ALL {
        let mut whole = scene.simulate(precision);
        let expected: Vec<RestReport> = (0..30).map(|_| told(&mut whole, 1)).collect();
        let mut cut = scene.simulate(precision);
        for step in 1..=20 {
            advance(&mut cut, 1);
            let (mut fork, mut fresh) = (cut.fork(), scene.simulate(precision));
            fresh.put(&cut.take());
            // Nine steps after it: the first one is expected[0].
            let found = [told(&mut fork, 9), told(&mut fresh, 9)];
            assert_eq!(found, [expected[step + 8]; 2], "{precision}, cut after step {step}");
        }
    }
}

#[test]
fn a_hung_sheet_comes_to_rest_and_does_not_leave_where_it_is_calm() {
    let mut network = sheet(8, 0.1, &sheet_rules(200.0, 0.02), 0.01);
    network.drag = 0.05;
    let mut scene = watched(network).under([0.0, -9.81, 0.0]);
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-6, max_iterations: 600 };
    for precision in Precision::ALL {
        let mut simulation = scene.simulate(precision);
        assert_eq!(told(&mut simulation, 100).calm_share(), 0.0, "{precision}: it swings");
        let calm = (0..400).any(|_| told(&mut simulation, 8).calm_share() == 1.0);
        assert!(calm, "{precision}: {:?}", told(&mut simulation, 1));
        let there = positions(&simulation);
        advance(&mut simulation, 80);
        let off = max_distance(&positions(&simulation), &there);
        assert!(off < REST.error, "{precision}: {off:e} m within ten windows");
    }
}

#[test]
fn an_error_that_rounding_hides_is_refused_with_the_least() {
    let mut scene = watched(particles(&[[0.0; 3], [0.0, -1.0, 0.0]], 1.0));
    let made = |scene: &Scene, precision| Simulation::new(&scene.setup(), precision).map(|_| ());
    // 200 roundings of 1 m, each 2^-24.
    let least = 200.0 / f64::from(1 << 24);
    for (error, is_made) in [(least, [true, true]), (0.99 * least, [false, true])] {
        scene.settings.rest = Some(RestSettings { error, ..REST });
        let found = [Precision::F32, Precision::F64].map(|precision| made(&scene, precision).is_ok());
        assert_eq!(found, is_made, "{error:e} m");
    }
    let refused = made(&scene, Precision::F32).expect_err("rounding hides it").to_string();
    assert!(refused.contains("at least 1.1920928955078125e-5 m is needed in f32"), "{refused}");

    for (rest, what) in [
        (RestSettings { error: 0.0, ..REST }, "the error of rest is 0 m"),
        (RestSettings { error: f64::NAN, ..REST }, "the error of rest is NaN m"),
        (RestSettings { within: -1.0, ..REST }, "the time of rest is -1 s"),
    ] {
        scene.settings.rest = Some(rest);
        let refused = made(&scene, Precision::F64).expect_err("no such number").to_string();
        assert!(refused.contains(what) && refused.contains("above 0 is needed"), "{refused}");
    }
}

#[test]
fn ranks_do_not_watch() {
    let setup = watched(particles(&[[0.0; 3]], 1.0)).setup();
    let refused = setup.check_for_ranks().expect_err("a rank knows a part").to_string();
    assert!(refused.contains("'body'") && refused.contains("watched for rest"), "{refused}");
}
