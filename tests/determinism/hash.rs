//! What the hash of a state is, and that it tells everything apart on which a further step depends.

use nappe_sim::{
    math::Precision,
    time_step::TimeStep,
    world::{Change, Simulation},
};
use nappe_tests::{
    Scene, golden,
    networks::{chain, sheet, sheet_rules},
    scene::{advance, positions, velocities},
};
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

use crate::snow::SnowRun;

/// Numbers as little-endian binary64.
fn bytes(numbers: impl IntoIterator<Item = f64>) -> Vec<u8> {
    numbers.into_iter().flat_map(f64::to_le_bytes).collect()
}

/// The hash of a state without pins on their way: from `parameters` and the numbers of each particle.
fn defined(step: u64, parameters: &[f64], particles: impl Iterator<Item = Vec<f64>>) -> u64 {
    let hashes = (0..).zip(particles).map(|(number, numbers)| xxh3_64_with_seed(&bytes(numbers), number));
    let sum = hashes.fold(0, u64::wrapping_add);
    let mut all = step.to_le_bytes().to_vec();
    all.extend(bytes(parameters.iter().copied()));
    all.extend(sum.to_le_bytes());
    xxh3_64(&all)
}

#[test]
fn the_hash_of_a_cloth_is_its_definition() {
    let x: Vec<_> = (0..5000).map(|i| [0.01 * f64::from(i), 0.0, 0.0]).collect();
    let mut network = chain(&x, 0.008, 20.0, 0.01, 0.002);
    network.drag = 0.25;
    let mut scene = Scene::new(network, 1e-3).under([0.0, -9.81, 0.5]);
    scene.wind = [1.0, 2.0, 3.0];
    for precision in Precision::ALL {
        let mut simulation = scene.simulate(precision);
        advance(&mut simulation, 2);
        let parameters = [0.0, -9.81, 0.5, 1.0, 2.0, 3.0, 0.25, 20.0, 0.01];
        let (x, v) = (positions(&simulation), velocities(&simulation));
        let particles = x.iter().zip(&v).map(|(x, v)| [*x, *v].concat());
        assert_eq!(simulation.state_hash(), defined(2, &parameters, particles), "{precision}");
    }
}

#[test]
fn the_hash_of_snow_is_its_definition() {
    for run in SnowRun::repeated() {
        // A length of certified steps that is held belongs to it too: these are fixed.
        let mut scene = run.scene();
        scene.settings.time_step = TimeStep::Unchecked(1e-4);
        let mut simulation = scene.simulate(run.precision);
        advance(&mut simulation, 1);
        let parameters = simulation.parameters();
        let parameters = [parameters.gravity, parameters.wind].concat();
        let particles = simulation.snow_particles().into_iter().map(|p| {
            let tensors = [p.elastic, p.affine].concat().concat();
            [&p.x[..], &p.v, &tensors, &[p.plastic_ratio]].concat()
        });
        let expected = defined(simulation.step_count(), &parameters, particles);
        assert_eq!(simulation.state_hash(), expected, "{}", run.key());
    }
}

fn hung() -> Scene {
    let method = golden::method("implicit_euler_clamped").expect("an integrator");
    Scene::new(sheet(8, 0.1, &sheet_rules(50.0, 0.01), 0.01), 1e-3).by(method)
}

fn simulate(scene: &Scene, steps: u64) -> Simulation {
    let mut simulation = scene.simulate(Precision::F64);
    advance(&mut simulation, steps);
    simulation
}

#[test]
fn every_parameter_that_changes_changes_the_hash() {
    let still = simulate(&hung(), 3);
    let springs = |stiffness, damping| Change::Springs { body: None, kind: None, stiffness, damping };
    let changes = [
        Change::Gravity([0.0, -1.0, 0.0]),
        Change::Wind([0.0, 0.0, 1.0]),
        Change::Drag(0.5),
        springs(Some(60.0), None),
        springs(None, Some(0.02)),
    ];
    let mut hashes = vec![still.state_hash()];
    for change in changes {
        let mut changed = still.fork();
        changed.apply(&[change]).expect("the change is allowed");
        assert_eq!(positions(&changed), positions(&still));
        hashes.push(changed.state_hash());
    }
    let count = hashes.len();
    hashes.sort_unstable();
    hashes.dedup();
    assert_eq!(hashes.len(), count, "two of them are equal");
}

#[test]
fn where_a_warm_start_begins_changes_the_hash() {
    let mut scene = hung().under([0.0, -9.81, 0.0]);
    let cold = simulate(&scene, 1);
    scene.settings.solver.warm_start = true;
    // The first step starts from 0 either way.
    let warm = simulate(&scene, 1);
    assert_eq!((positions(&cold), velocities(&cold)), (positions(&warm), velocities(&warm)));
    assert_ne!(cold.state_hash(), warm.state_hash());
}

#[test]
fn a_pin_on_its_way_changes_the_hash_until_it_arrives() {
    let mut still = simulate(&hung(), 2);
    let mut sent = still.fork();
    // To where it is: positions and velocities are those of one that was not sent.
    let target = positions(&still)[0];
    sent.apply(&[Change::Pin { particle: 0, target, duration: 5e-3 }]).expect("it is pinned");
    for step in 0..=7 {
        assert_eq!(positions(&still), positions(&sent), "step {step}");
        assert_eq!(still.state_hash() == sent.state_hash(), step >= 5, "step {step}");
        advance(&mut still, 1);
        advance(&mut sent, 1);
    }

    // Of a pin that is sent twice before a step, the last counts.
    let mut twice = still.fork();
    for target in [[9.0; 3], target] {
        twice.apply(&[Change::Pin { particle: 0, target, duration: 5e-3 }]).expect("it is pinned");
    }
    let mut once = still.fork();
    once.apply(&[Change::Pin { particle: 0, target, duration: 5e-3 }]).expect("it is pinned");
    assert_eq!(twice.state_hash(), once.state_hash());
}
