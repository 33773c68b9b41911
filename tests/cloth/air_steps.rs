//! Steps in air: energies, bounds, every way of solving, changes, wind over time.

use nappe_sim::{
    cloth::{Air, Integrator, Minimizer},
    linalg::{OperatorKind, PreconditionerKind},
    math::Precision,
    mesh::TriangleMesh,
    report::BoundKind,
    time_step::TimeStep,
    world::{Change, ChangeError, Simulation, WorldSetup},
};
use nappe_tests::{
    Method, Scene,
    networks::{chain, sheet_rules},
    scene::{advance, max_distance, positions, velocities},
};

use crate::air::{AIR, GRAVITY, SURFACE, cloth, fallen, plate};

#[test]
fn no_method_gains_energy_in_air_beyond_what_the_air_gave() {
    for method in Method::all() {
        if method.integrator == Integrator::ExplicitEuler {
            continue;
        }
        let mut mesh = TriangleMesh::grid(10, 10, 0.1);
        mesh.points.iter_mut().for_each(|point| *point = [point[0], -point[2], 0.0]);
        let mut network = cloth(&mesh, [10, 10], &sheet_rules(50.0, 0.0), SURFACE);
        network.pins = (0..10).map(|row| row * 10).collect();
        let mut scene = Scene::new(network, 5e-3).by(method).under([0.0, -GRAVITY, 0.0]).certified();
        scene.wind = [6.0, 0.0, 1.0];
        let mut simulation = scene.simulate(Precision::F64);
        let start = simulation.diagnose().total_energy();
        let (mut given, mut most, mut moved) = (0.0, f64::NEG_INFINITY, 0.0_f64);
        for _ in 0..1000 {
            let report = advance(&mut simulation, 1);
            given += report.diagnostics.external_work;
            most = most.max(report.diagnostics.total_energy() - start - given);
            let energies = report.diagnostics;
            moved = moved.max(energies.kinetic_energy + energies.elastic_energy);
        }
        // Implicit Euler only loses; the energy of the others swings about the one that they keep, the most that of the symplectic
        // one of order 1.
        let share = match method.integrator {
            Integrator::ImplicitEuler => 1e-9,
            Integrator::SymplecticEuler => 0.2,
            Integrator::Bdf2 => 0.05,
            _ => 0.01,
        };
        assert!(most < share * moved, "{}: {most:e} of {moved:e} J, given {given:e}", method.name());
        assert!(given > 0.0, "{}: {given} J", method.name());
    }
}

/// How much a small change of the terminal velocity of a plate has grown after fifty explicit steps of a length (s).
fn growth(integrator: Integrator, dt: f64) -> f64 {
    let strong = Air { normal: 10.0, ..AIR };
    // Two triangles: a larger plate that nothing holds folds in such a wind, before fifty steps are over.
    let mut network = plate(2, |point| point);
    network.air = Some(strong);
    // At rest in wind from below of 50 m/s, which carries it.
    let terminal = 50.0;
    let gravity = 0.5 * strong.density * strong.normal * terminal * terminal / SURFACE;
    network.v.iter_mut().for_each(|v| *v = [0.0, 1e-6, 0.0]);
    let mut scene = Scene::new(network, dt).under([0.0, -gravity, 0.0]);
    scene.settings.integrator = integrator;
    scene.wind = [0.0, terminal, 0.0];
    let mut simulation = scene.simulate(Precision::F64);
    advance(&mut simulation, 50);
    fallen(&simulation)[1].abs() / 1e-6
}

#[test]
fn explicit_steps_in_strong_wind_are_stable_up_to_their_bound_and_no_further() {
    for integrator in [Integrator::ExplicitEuler, Integrator::SymplecticEuler] {
        let mut network = plate(10, |point| point);
        network.air = Some(Air { normal: 10.0, ..AIR });
        let mut scene = Scene::new(network, 1e-3);
        scene.settings.integrator = integrator;
        scene.wind = [0.0, 50.0, 0.0];
        let bound = scene.simulate(Precision::F64).step_bounds()[0].dt;
        // 1 / (k |u|) of u' = g - k u²: where d(u') / du is -2 / h.
        let exact = SURFACE / (0.5 * 1.2 * 10.0 * 50.0);
        assert!((bound / exact - 1.0).abs() < 0.02, "{bound} s, not {exact}");
        let (within, beyond) = (growth(integrator, 0.98 * bound), growth(integrator, 1.05 * exact));
        assert!(within < 1.0, "{}: {within} at 0.98 of the bound", integrator.name());
        assert!(beyond > 10.0, "{}: {beyond} at 1.05 of the limit", integrator.name());
    }

    // Who steps by the bound is told that the air sets it, and stays below it on the way.
    let mut network = plate(10, |point| point);
    network.air = Some(Air { normal: 10.0, ..AIR });
    let mut scene = Scene::new(network, 0.02).certified();
    scene.settings.integrator = Integrator::SymplecticEuler;
    scene.wind = [0.0, 50.0, 0.0];
    let mut simulation = scene.simulate(Precision::F64);
    let steps = advance(&mut simulation, 1).cloth.expect("a cloth");
    assert_eq!(steps.bound.kind, BoundKind::Medium, "{steps:?}");
    let mut fastest = 0.0_f64;
    for _ in 0..50 {
        advance(&mut simulation, 1);
        fastest = velocities(&simulation).iter().map(|v| v[1]).fold(fastest, f64::max);
    }
    assert!(fastest < 50.0, "{fastest} m/s in a wind of 50 m/s");

    // One of a fixed length is refused, with the same name.
    scene.settings.time_step = TimeStep::Fixed(0.01);
    let error = Simulation::new(&scene.setup(), Precision::F64).expect_err("too long");
    assert!(error.to_string().contains("medium"), "{error}");
}

/// A hung sheet in wind across it.
fn hung(side: usize) -> Scene {
    let mut mesh = TriangleMesh::grid(side, side, 0.05);
    mesh.points.iter_mut().for_each(|point| *point = [point[0], -point[2], 0.0]);
    let mut network = cloth(&mesh, [side, side], &sheet_rules(100.0, 0.01), SURFACE);
    network.pins = vec![0, side as u32 - 1];
    network.drag = 1e-5;
    let mut scene = Scene::new(network, 5e-3).under([0.0, -GRAVITY, 0.0]);
    scene.wind = [1.0, 0.5, 4.0];
    scene
}

#[test]
fn every_operator_and_preconditioner_has_the_same_air() {
    let run = |operator: OperatorKind, preconditioner: PreconditionerKind, minimizer: Minimizer| {
        let mut scene = hung(16);
        scene.settings.solver.operator = operator;
        scene.settings.solver.preconditioner = preconditioner;
        scene.settings.minimizer = minimizer;
        let mut simulation = scene.simulate(Precision::F64);
        advance(&mut simulation, 40);
        positions(&simulation)
    };
    let (free, stored) = (OperatorKind::MatrixFree, OperatorKind::Assembled);
    let (blocks, coarse) = (PreconditionerKind::BlockJacobi, PreconditionerKind::TwoLevel);
    for minimizer in [Minimizer::OneStep, nappe_tests::NEWTON] {
        let expected = run(free, blocks, minimizer);
        for (operator, preconditioner) in [(stored, blocks), (free, coarse), (stored, coarse)] {
            let apart = max_distance(&run(operator, preconditioner, minimizer), &expected);
            assert!(apart < 1e-9, "{operator:?}, {preconditioner:?}, {minimizer:?}: {apart:e} m");
        }
    }
}

#[test]
fn one_linear_solve_newton_and_sweeps_make_the_same_small_steps() {
    let run = |minimizer: Minimizer| {
        let mut scene = hung(8);
        (scene.dt, scene.settings.minimizer) = (1e-4, minimizer);
        let mut simulation = scene.simulate(Precision::F64);
        advance(&mut simulation, 100);
        positions(&simulation)
    };
    let expected = run(nappe_tests::NEWTON);
    for minimizer in [Minimizer::OneStep, Minimizer::VertexBlockDescent { sweeps: 200 }] {
        let apart = max_distance(&run(minimizer), &expected);
        assert!(apart < 1e-6, "{minimizer:?}: {apart:e} m");
    }
}

#[test]
fn air_changes_between_two_steps_and_who_feels_none_says_so() {
    let mut simulation = hung(6).simulate(Precision::F64);
    let of = |body: Option<&str>, density: f64| Change::Air {
        body: body.map(str::to_owned),
        density: Some(density),
        normal: None,
        lift: Some(0.5),
        tangential: None,
    };
    simulation.apply(&[of(Some("body"), 2.4)]).expect("a fair change");
    let air = simulation.parameters().cloths[0].air;
    assert_eq!(air, Some(Air { density: 2.4, lift: 0.5, ..AIR }));
    // Twice the density from the start is the same.
    let mut scene = hung(6);
    scene.network.air = air;
    let mut other = scene.simulate(Precision::F64);
    advance(&mut simulation, 10);
    advance(&mut other, 10);
    assert_eq!(positions(&simulation), positions(&other));
    assert_eq!(simulation.state_hash(), other.state_hash());

    for (change, told) in [
        (of(Some("body"), -1.0), "density is -1"),
        (of(None, 1e6), "density is 1000000"),
        (of(Some("sail"), 1.0), "no body is named 'sail'"),
    ] {
        let error = simulation.apply(&[change]).expect_err("refused").to_string();
        assert!(error.contains(told), "{error}");
    }
    scene.network.air = None;
    let mut without = scene.simulate(Precision::F64);
    let refused = ChangeError::NoAir { body: "body".to_owned() };
    assert_eq!(without.apply(&[of(Some("body"), 1.0)]), Err(refused));
    assert_eq!(without.apply(&[of(None, 1.0)]), Err(ChangeError::NoneFeelsAir));

    let mut network = chain(&[[0.0; 3], [1.0, 0.0, 0.0]], 1.0, 1.0, 0.0, 1.0);
    network.air = Some(AIR);
    let error = Simulation::new(&Scene::new(network, 0.01).setup(), Precision::F64).expect_err("a chain");
    assert!(error.to_string().contains("no triangles"), "{error}");
}

#[test]
fn wind_over_time_carries_a_plate_as_its_keys_say_until_a_change() {
    // Drag alone, so that v' = (c / m) (w(t) - v): of w = a t, v = a (t - tau (1 - exp(-t / tau))).
    let (slope, tau, dt) = (3.0, 0.2, 1e-3);
    let mut network = nappe_tests::networks::particles(&[[0.0; 3]], 0.1);
    network.drag = 0.1 / tau;
    let scene = Scene::new(network, dt).by(Method::all()[3]);
    let keys = vec![(0.0, [0.0; 3]), (1.0, [slope, 0.0, 0.0]), (2.0, [slope, 0.0, 0.0])];
    let setup = WorldSetup { wind_at: keys, ..scene.setup() };
    let (mut simulation, _) = Simulation::new(&setup, Precision::F64).expect("a gust");
    advance(&mut simulation, 1000);
    let expected = slope * (1.0 - tau * (1.0 - f64::exp(-1.0 / tau)));
    assert!((velocities(&simulation)[0][0] - expected).abs() < 1e-5);
    assert!((simulation.parameters().wind[0] - slope).abs() < 1e-12);
    simulation.apply(&[Change::Wind([0.0; 3])]).expect("a fair change");
    let before = velocities(&simulation)[0][0];
    advance(&mut simulation, 1000);
    assert!((velocities(&simulation)[0][0] - before * f64::exp(-1.0 / tau)).abs() < 1e-5);

    let back = WorldSetup { wind_at: vec![(1.0, [0.0; 3]), (0.5, [0.0; 3])], ..scene.setup() };
    let error = Simulation::new(&back, Precision::F64).expect_err("times grow").to_string();
    assert!(error.contains("key 1 of the wind is at 0.5 s"), "{error}");
}
