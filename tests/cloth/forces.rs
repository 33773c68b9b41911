//! Given forces on particles, states from outside, and the start again.

use nappe_sim::{
    cloth::{Integrator, Minimizer, Network},
    math::Precision,
    mesh::TriangleMesh,
    world::{BodySetup, Change, Forces, Simulation, TimedForce, WorldSetup},
};
use nappe_tests::{
    Method, Scene,
    networks::{particles, sheet, sheet_rules},
    scene::{advance, max_distance, momenta, positions, velocities},
};

/// The simulation of a scene with forces of the scene.
fn with_forces(scene: &Scene, forces: &[TimedForce]) -> Simulation {
    let setup = scene.setup();
    let bodies =
        setup.bodies.iter().map(|body| BodySetup { forces: forces.to_vec(), ..body.clone() }).collect();
    let (simulation, _) =
        Simulation::new(&WorldSetup { bodies, ..setup }, Precision::F64).expect("a fair scene");
    simulation
}

fn on_all(count: u32, force: [f64; 3]) -> TimedForce {
    TimedForce { particles: (0..count).collect(), force, from: 0.0, until: f64::INFINITY }
}

fn call(particles: &[u32], force: [f64; 3]) -> Change {
    Change::Force { body: "body".to_owned(), particles: particles.into(), forces: Forces::One(force) }
}

#[test]
fn a_force_changes_the_momentum_by_itself_times_the_time() {
    for method in Method::all() {
        let mut network = particles(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]], 0.3);
        network.drag = 0.0;
        let dt = 0.01;
        let scene = Scene::new(network, dt).by(method);
        let masses = scene.network.masses.clone();
        // From the middle of a step to a quarter of another, and by a call from step 20 to 30.
        let timed = TimedForce { particles: vec![0, 2], force: [0.4, -0.2, 0.1], from: 0.035, until: 0.1025 };
        let mut simulation = with_forces(&scene, &[timed]);
        advance(&mut simulation, 20);
        simulation.apply(&[call(&[1], [0.0, 0.0, 3.0])]).expect("a fair force");
        advance(&mut simulation, 10);
        simulation.apply(&[call(&[1], [0.0; 3])]).expect("a fair force");
        advance(&mut simulation, 10);
        let (momentum, _) = momenta(&simulation, &masses);
        let expected = [0.8 * 0.0675, -0.4 * 0.0675, 0.2 * 0.0675 + 3.0 * 10.0 * dt];
        for c in 0..3 {
            let error = (momentum[c] - expected[c]).abs();
            assert!(error < 1e-12, "{}: {momentum:?} N s, not {expected:?}", method.name());
        }
    }
}

#[test]
fn a_force_on_all_particles_is_gravity() {
    let gravity = [0.7, -3.0, 1.1];
    for method in Method::all() {
        let mass = 0.005;
        let network = sheet(10, 0.05, &sheet_rules(100.0, 0.02), mass);
        let pins = network.pins.clone();
        let scene = Scene::new(network, 1e-3).by(method);
        let mut fallen = scene.clone().under(gravity).simulate(Precision::F64);
        let mut pushed = scene.simulate(Precision::F64);
        assert!(!pins.is_empty());
        // All of them, pins excepted.
        pushed.apply(&[call(&[], gravity.map(|c| c * mass))]).expect("a fair force");
        let (a, b) = (advance(&mut fallen, 60), advance(&mut pushed, 60));
        // What falls a little of its first guess beforehand along gravity sweeps elsewhere.
        let is_swept = matches!(method.minimizer, Minimizer::VertexBlockDescent { .. });
        let tolerance = if is_swept { 1e-8 } else { 1e-12 };
        let apart = max_distance(&positions(&fallen), &positions(&pushed));
        assert!(apart < tolerance, "{}: {apart:e} m", method.name());
        let lost = |report: &nappe_sim::report::StepReport| report.diagnostics.gravitational_energy;
        assert!(lost(&a) < 0.0 && lost(&b) == 0.0);
    }
}

#[test]
fn the_work_of_forces_is_the_energy_that_they_give() {
    for integrator in [Integrator::SymplecticEuler, Integrator::VelocityVerlet, Integrator::ImplicitEuler] {
        let mut network = particles(&[[0.0; 3]], 2.0);
        network.v[0] = [1.0, 0.0, 0.0];
        let mut scene = Scene::new(network, 0.01);
        scene.settings.integrator = integrator;
        let mut simulation = with_forces(&scene, &[on_all(1, [3.0, 1.0, 0.0])]);
        let start = simulation.diagnose().kinetic_energy;
        let (mut work, mut energy) = (0.0, start);
        for _ in 0..100 {
            let report = advance(&mut simulation, 1);
            work += report.diagnostics.external_work;
            energy = report.diagnostics.kinetic_energy;
        }
        let gained = energy - start;
        // What implicit Euler takes of it: h² f² / 2 m per step.
        let tolerance =
            if integrator == Integrator::ImplicitEuler { 1.01 * 100.0 * 1e-4 * 10.0 / 4.0 } else { 1e-12 };
        assert!(
            (work - gained).abs() < tolerance * gained.max(1.0),
            "{}: {work} J, {gained} J",
            integrator.name()
        );
        assert!(work >= gained - 1e-12, "{}", integrator.name());
    }
}

#[test]
fn no_step_is_refused_or_gains_energy_for_a_force() {
    for method in Method::all() {
        if method.integrator == Integrator::ExplicitEuler {
            continue;
        }
        let network = sheet(8, 0.1, &sheet_rules(50.0, 0.001), 0.01);
        let scene = Scene::new(network, 5e-3).by(method).certified();
        let pull = TimedForce { particles: vec![63], force: [0.5, -1.0, 0.8], from: 0.1, until: 0.6 };
        let mut simulation = with_forces(&scene, &[pull]);
        let (mut given, mut most, mut moved) = (0.0, f64::NEG_INFINITY, 0.0_f64);
        for _ in 0..300 {
            let report = advance(&mut simulation, 1);
            given += report.diagnostics.external_work;
            most = most.max(report.diagnostics.total_energy() - given);
            moved = moved.max(report.diagnostics.kinetic_energy + report.diagnostics.elastic_energy);
        }
        let share = if method.integrator == Integrator::ImplicitEuler { 1e-9 } else { 0.2 };
        assert!(most < share * moved + 1e-12, "{}: {most:e} of {moved:e} J", method.name());
        assert!(given > 0.01, "{}: {given} J", method.name());
    }
}

/// A hung sheet in air that something has happened to.
fn hung() -> Scene {
    let mut mesh = TriangleMesh::grid(12, 12, 0.05);
    mesh.points.iter_mut().for_each(|point| *point = [point[0], -point[2], 0.0]);
    let mut network = Network::from_lattice(&mesh, [12, 12], &sheet_rules(100.0, 0.01), 0.002);
    network.pins = vec![0, 11];
    network.air = Some(nappe_sim::cloth::Air::default());
    let mut scene = Scene::new(network, 5e-3).under([0.0, -9.81, 0.0]).certified();
    scene.wind = [1.0, 0.5, 4.0];
    scene
}

fn state(x: Vec<[f64; 3]>, v: Option<Vec<[f64; 3]>>) -> Change {
    Change::State { body: "body".to_owned(), positions: x.into(), velocities: v.map(Into::into) }
}

#[test]
fn what_was_read_can_be_set_and_goes_on_with_the_same_bits() {
    for precision in Precision::ALL {
        let mut first = hung().simulate(precision);
        advance(&mut first, 40);
        let (x, v) = (positions(&first), velocities(&first));
        let mut second = hung().simulate(precision);
        advance(&mut second, 3);
        second.apply(&[state(x, Some(v))]).expect("a fair state");
        advance(&mut first, 60);
        advance(&mut second, 60);
        assert_eq!(positions(&first), positions(&second));
        assert_eq!(velocities(&first), velocities(&second));
    }
}

#[test]
fn what_was_taken_goes_on_with_the_same_bits_and_forces() {
    for method in Method::all().into_iter().filter(|method| method.integrator != Integrator::ExplicitEuler) {
        let scene = hung().by(method);
        let timed = TimedForce { particles: vec![60], force: [0.05, 0.0, 0.0], from: 0.02, until: 0.2 };
        let new = || with_forces(&scene, std::slice::from_ref(&timed));
        let mut first = new();
        first.apply(&[call(&[5, 70], [0.0, 0.02, 0.0])]).expect("a fair force");
        advance(&mut first, 15);
        let mut second = new();
        second.put(&first.take());
        assert_eq!(first.state_hash(), second.state_hash());
        advance(&mut first, 40);
        advance(&mut second, 40);
        assert_eq!(first.state_hash(), second.state_hash(), "{}", method.name());
    }
}

#[test]
fn a_reset_is_the_start_whatever_came_before() {
    for method in Method::all() {
        let mut scene = hung().by(method);
        scene.settings.tolerance = None;
        if method.integrator == Integrator::ExplicitEuler {
            scene = scene.in_substeps(16);
        }
        let mut new = scene.simulate(Precision::F32);
        let mut used = scene.simulate(Precision::F32);
        advance(&mut used, 7);
        let pin = Change::Pin { particle: 11, target: [0.4, 0.1, 0.0], duration: 0.5 };
        let changes = [Change::Gravity([0.0; 3]), Change::Wind([9.0, 0.0, 0.0]), Change::Drag(0.1), pin];
        used.apply(&changes).expect("fair changes");
        used.apply(&[call(&[5, 60], [0.1, 0.0, 0.0])]).expect("a fair force");
        advance(&mut used, 12);
        used.apply(&[Change::Reset]).expect("a reset");
        assert_eq!(used.parameters(), new.parameters());
        assert_eq!(used.step_count(), 19);
        for step in [0, 1, 99] {
            if step > 0 {
                advance(&mut new, step);
                advance(&mut used, step);
            }
            assert_eq!(positions(&new), positions(&used), "{}", method.name());
            assert_eq!(velocities(&new), velocities(&used), "{}", method.name());
        }
    }
}

#[test]
fn forces_count_in_the_hash_only_where_there_are_some() {
    let mut simulation = hung().simulate(Precision::F64);
    let hash = simulation.state_hash();
    simulation.apply(&[call(&[5], [0.1, 0.0, 0.0])]).expect("a fair force");
    let pulled = simulation.state_hash();
    assert_ne!(pulled, hash);
    assert_eq!(simulation.fork().state_hash(), pulled);
    simulation.apply(&[call(&[5], [0.0; 3])]).expect("a fair force");
    assert_eq!(simulation.state_hash(), hash);
}

#[test]
fn forces_and_states_that_do_not_fit_are_refused_and_change_nothing() {
    let mut simulation = hung().simulate(Precision::F64);
    let (hash, x) = (simulation.state_hash(), positions(&simulation));
    let far = |value: f64| {
        let mut far = x.clone();
        far[7][1] = value;
        far
    };
    let each = Change::Force {
        body: "body".to_owned(),
        particles: [1, 2].into(),
        forces: Forces::Each([[1.0, 0.0, 0.0]].into()),
    };
    let elsewhere =
        Change::Force { body: "sail".to_owned(), particles: [].into(), forces: Forces::One([0.0; 3]) };
    for (change, told) in [
        (call(&[0], [1.0, 0.0, 0.0]), "body: particle 0 is pinned"),
        (call(&[144], [1.0, 0.0, 0.0]), "body: there is no particle 144: the body has 144, from 0"),
        (call(&[5], [2e9, 0.0, 0.0]), "force is 2000000000: allowed are -1000000000 to 1000000000"),
        (call(&[5], [f64::NAN, 0.0, 0.0]), "force is NaN"),
        (each, "body: 1 forces for 2 particles"),
        (elsewhere, "no body is named 'sail'; there are: body"),
        (state(x[..143].to_vec(), None), "body: positions of 143 particles, and the body has 144"),
        (state(x.clone(), Some(x[..2].to_vec())), "body: velocities of 2 particles"),
        (state(far(f64::INFINITY), None), "body: positions of particle 7 is inf"),
        (state(far(2e6), None), "body: positions of particle 7 is 2000000"),
    ] {
        let error = simulation.apply(&[Change::Gravity([1.0; 3]), change]).expect_err("refused").to_string();
        assert!(error.contains(told), "{error}, not {told}");
        assert_eq!(simulation.state_hash(), hash);
    }
    let pinned = TimedForce { particles: vec![11], ..on_all(0, [1.0, 0.0, 0.0]) };
    let backwards = TimedForce { until: 0.0, ..on_all(3, [1.0, 0.0, 0.0]) };
    for (force, told) in [(pinned, "particle 11, which is pinned"), (backwards, "until 0 s")] {
        let setup = hung().setup();
        let bodies =
            setup.bodies.iter().map(|body| BodySetup { forces: vec![force.clone()], ..body.clone() });
        let setup = WorldSetup { bodies: bodies.collect(), ..hung().setup() };
        let error = Simulation::new(&setup, Precision::F64).expect_err("refused").to_string();
        assert!(error.contains(told), "{error}");
    }
}
