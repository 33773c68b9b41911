//! Forces and accelerations of snow, as frames show them: they add up to the weight, they are what a step from rest does, and they
//! have the same bits for any number of threads.

use nappe_sim::{
    field::Field,
    math::{Mat3, Precision},
    world::{Change, Forces, Simulation, WorldSetup},
};
use nappe_tests::{
    Random,
    scene::{difference, norm, velocities},
    snow::{SnowScene, Variant, elastic, lattice, object, rework, step_once},
    threads::with_threads,
};

use crate::reference::rows;

/// Side of a cell (m).
const H: f64 = 0.1;
/// Volume at rest (m³) of a particle, and density (kg/m³).
const VOLUME: f64 = 1.1e-4;
const DENSITY: f64 = 400.0;
const GRAVITY: [f64; 3] = [0.4, -9.81, 0.2];

fn vectors(simulation: &Simulation, field: Field) -> Vec<[f64; 3]> {
    let mut vectors = vec![[0.0; 3]; simulation.particle_count()];
    simulation.read::<f64>(field, vectors.as_flattened_mut());
    vectors
}

fn sum(vectors: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|c| vectors.iter().map(|vector| vector[c]).sum())
}

/// A block at rest, in steps of 1 us.
fn block(variant: Variant) -> SnowScene {
    let mut random = Random::seeded(83);
    let x: Vec<_> = lattice([-0.23, 0.11, -0.42], [7, 6, 5], [0.5 * H; 3])
        .into_iter()
        .map(|x| x.map(|c| c + 0.01 * random.number()))
        .collect();
    let body = object("block", x, VOLUME, DENSITY, elastic(1.4e5, 0.2));
    SnowScene::new(vec![body], H, 1e-6).by(variant)
}

/// The simulation of a scene whose particles are turned and strained, each its own way.
fn strained(scene: &SnowScene, precision: Precision) -> Simulation {
    let mut random = Random::seeded(7);
    let turn = random.rotation();
    let shear = Mat3::new(1.0, 0.12, -0.05, 0.0, 0.97, 0.08, 0.0, 0.0, 1.04);
    let mut simulation = scene.simulate(precision);
    rework(&mut simulation, |_, p| {
        p.elastic = rows(&(turn * shear * (Mat3::identity() + random.matrix() * 0.02)));
    });
    simulation
}

#[test]
fn internal_forces_add_up_to_nothing_and_all_of_them_to_the_weight() {
    for variant in Variant::all() {
        let bar =
            object("bar", lattice([0.0; 3], [16, 4, 4], [0.5 * H; 3]), VOLUME, DENSITY, elastic(2e4, 0.3));
        let bar = SnowScene::new(vec![bar], H, 1e-6).by(variant).periodic([2, 0, 0]);
        for scene in [block(variant), bar] {
            let mass: f64 = scene.masses().iter().sum();
            for gravity in [[0.0; 3], GRAVITY] {
                let simulation = strained(&scene.clone().under(gravity), Precision::F64);
                let forces = vectors(&simulation, Field::Forces);
                let largest = forces.iter().map(|force| norm(*force)).fold(0.0, f64::max);
                let expected = gravity.map(|g| mass * g);
                let error = norm(difference(sum(&forces), expected));
                let name = variant.name();
                assert!(error < 1e-12 * largest, "{name}: off by {error} N, the largest is {largest} N");
                assert!(largest > 0.1, "{name}: it is strained");
            }
        }
    }
}

#[test]
fn a_step_from_rest_is_the_acceleration_times_its_length() {
    for variant in Variant::all() {
        let scene = block(variant).under(GRAVITY);
        let mut simulation = strained(&scene, Precision::F64);
        let call = Change::Force {
            body: "block".to_owned(),
            particles: [3, 77].into(),
            forces: Forces::One([0.2, 0.5, -0.1]),
        };
        simulation.apply(&[call]).expect("a fair force");
        let accelerations = vectors(&simulation, Field::Accelerations);
        let forces = vectors(&simulation, Field::Forces);
        let largest = accelerations.iter().map(|a| norm(*a)).fold(0.0, f64::max);
        step_once(&mut simulation);
        for (particle, v) in velocities(&simulation).into_iter().enumerate() {
            let found = v.map(|c| c / scene.dt);
            let error = norm(difference(found, accelerations[particle]));
            let name = variant.name();
            assert!(error < 1e-11 * largest, "{name}, particle {particle}: off by {error} of {largest} m/s²");
            let mass = DENSITY * VOLUME;
            let error = norm(difference(accelerations[particle].map(|c| mass * c), forces[particle]));
            assert!(error < 1e-12 * mass * largest, "{name}, particle {particle}: off by {error} N");
        }
    }
}

#[test]
fn a_medium_pulls_at_each_particle_by_its_own_velocity() {
    let (drag, wind, start) = (3.0, [2.0, 0.0, -1.0], [0.5, 1.0, 0.0]);
    for variant in Variant::all() {
        let mut scene = block(variant).under(GRAVITY).moving(|_| start);
        scene.settings.drag = drag;
        let setup = WorldSetup { wind, ..scene.setup() };
        let (simulation, _) = Simulation::new(&setup, Precision::F64).expect("a fair scene");
        let expected = [0, 1, 2].map(|c| GRAVITY[c] - drag * (start[c] - wind[c]));
        for a in vectors(&simulation, Field::Accelerations) {
            assert!(norm(difference(a, expected)) < 1e-12, "{}: {a:?}, not {expected:?}", variant.name());
        }
    }
}

#[test]
fn forces_of_snow_have_the_same_bits_for_any_number_of_threads() {
    for variant in Variant::all() {
        for precision in Precision::ALL {
            let simulation = strained(&block(variant).under(GRAVITY), precision);
            let read = |threads| {
                let both = || [Field::Forces, Field::Accelerations].map(|field| vectors(&simulation, field));
                with_threads(threads, both)
            };
            let alone = read(1);
            for threads in [2, 3, 8] {
                assert_eq!(read(threads), alone, "{} in {precision}, {threads} threads", variant.name());
            }
        }
    }
}

#[test]
fn the_topology_says_masses_and_volumes() {
    let scene = block(Variant::all()[0]);
    let simulation = scene.simulate(Precision::F64);
    let topology = simulation.topology();
    assert_eq!(topology[0].masses, scene.masses());
    assert_eq!(topology[0].volumes, vec![VOLUME; scene.masses().len()]);
}
