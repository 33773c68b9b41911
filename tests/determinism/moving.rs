//! The same bits with colliders that keys and calls move: threads, ranks, forks and states in the middle of a way.

use std::sync::Arc;

use nappe_cluster::Cluster;
use nappe_sim::{
    cloth::{Hessian, Integrator},
    collide::{
        Collider, Contact, Pose, PoseKey, Shape, StartInside, Way,
        shape::{Cuboid, Sphere},
    },
    math::Precision,
    report::NoStopwatch,
    snow::{Kernel, Transfer},
    world::{Change, ColliderMove, MoveKey, Simulation},
};
use nappe_tests::{
    Method, Scene,
    networks::{scatter, sheet, sheet_rules},
    ranks::on_ranks,
    snow::{SnowScene, Variant, elastic, lattice, object},
    threads::with_threads,
};

const TURN: [f64; 4] = [0.0, 0.28, 0.0, 0.96];

fn collider(name: &str, shape: Shape, keys: Vec<PoseKey>) -> Collider {
    Collider {
        name: name.to_owned(),
        shape,
        velocity: [0.0; 3],
        way: (!keys.is_empty()).then_some(Way { keys }),
        friction: 0.4,
        restitution: 0.2,
        margin: 0.004,
        contact: Contact::default(),
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::Warn,
    }
}

/// A box that turns by keys, and a ball that a call moves.
fn colliders(center: [f64; 3]) -> Vec<Collider> {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let cuboid = Cuboid { center, half_extent: [0.3, 0.05, 0.1], axes };
    let key = |time: f64, turn: [f64; 4]| PoseKey { time, pose: Pose { position: center, turn } };
    let keys = vec![key(0.004, Pose::NO_TURN), key(0.05, TURN), key(0.09, [0.6, 0.0, 0.0, 0.8])];
    let ball = Sphere { center: [center[0] + 0.2, center[1] - 0.02, center[2] + 0.3], radius: 0.1 };
    vec![collider("box", Shape::Box(cuboid), keys), collider("ball", Shape::Sphere(ball), Vec::new())]
}

/// Moves the ball, from where it is at 0.01 s.
fn call() -> Change {
    let key = |time: f64, x: f64| MoveKey { time, position: Some([x, -0.1, 0.5]), turn: Some(TURN) };
    let keys = [key(0.02, 0.5), key(0.05, 0.3)].into();
    Change::Collider(ColliderMove { collider: "ball".to_owned(), keys })
}

fn cloth() -> Scene {
    let mut network = sheet(18, 0.05, &sheet_rules(100.0, 0.02), 0.005);
    network.pins.clear();
    for (i, v) in network.v.iter_mut().enumerate() {
        *v = [0.3 * scatter(i), -1.0, 0.3 * scatter(i + 1000)];
    }
    let method = Method::new(Integrator::ImplicitEuler, Hessian::Absolute);
    let mut scene = Scene::new(network, 1e-3).by(method).in_substeps(2).under([0.0, -9.81, 0.0]);
    scene.settings.block_size = 64;
    scene.colliders = colliders([0.4, -0.06, 0.4]);
    scene
}

fn snow() -> SnowScene {
    let x = lattice([0.0; 3], [10, 6, 10], [0.05; 3]);
    let body = object("block", x, 0.05_f64.powi(3), 400.0, elastic(1.4e5, 0.2));
    let variant = Variant { kernel: Kernel::Quadratic, transfer: Transfer::Mls };
    let mut scene = SnowScene::new(vec![body], 0.1, 1e-3).by(variant).under([0.0, -9.81, 0.0]);
    scene.colliders = colliders([0.25, -0.06, 0.25]);
    scene
}

/// Steps in which everything moves.
const STEPS: u64 = 60;

fn go(simulation: &mut Simulation, steps: u64) {
    for _ in 0..steps {
        if simulation.step_count() == 10 {
            simulation.apply(&[call()]).expect("a ball may move");
        }
        simulation.step(&mut NoStopwatch).expect("it is stable");
    }
}

/// Both scenes in both precisions.
fn made() -> Vec<Simulation> {
    let of = |precision| [cloth().simulate(precision), snow().simulate(precision)];
    Precision::ALL.into_iter().flat_map(of).collect()
}

fn hashes() -> Vec<u64> {
    let hash = |mut simulation: Simulation| {
        go(&mut simulation, STEPS);
        simulation.state_hash()
    };
    made().into_iter().map(hash).collect()
}

#[test]
fn moving_colliders_have_the_same_bits_for_any_number_of_threads() {
    let expected = with_threads(1, hashes);
    for threads in 2..=4 {
        assert_eq!(with_threads(threads, hashes), expected, "{threads} threads");
    }
}

#[test]
fn moving_colliders_have_the_same_bits_over_ranks() {
    let setups = [cloth().setup(), snow().setup()];
    for setup in &setups {
        let alone = with_threads(2, || {
            let (mut simulation, _) = Simulation::new(setup, Precision::F32).expect("it is in");
            go(&mut simulation, STEPS);
            simulation.state_hash()
        });
        for size in [2, 3] {
            let work = |ranks: Arc<dyn Cluster>| {
                let (mut simulation, _) = Simulation::over(setup, Precision::F32, ranks).expect("it is in");
                go(&mut simulation, STEPS);
                let (mut whole, _) = Simulation::new(setup, Precision::F32).expect("it is in");
                whole.put(&simulation.take());
                let poses = [0, 1].map(|index| whole.collider_pose(index));
                assert_eq!(poses, [0, 1].map(|index| simulation.collider_pose(index)));
                whole.state_hash()
            };
            assert_eq!(on_ranks(size, 2, work)[0].0, alone, "{size} ranks");
        }
    }
}

#[test]
fn a_fork_and_a_state_in_the_middle_of_a_way_go_on_with_the_same_bits() {
    with_threads(2, || {
        for (mut simulation, mut fresh) in made().into_iter().zip(made()) {
            go(&mut simulation, 30);
            let mut fork = simulation.fork();
            fresh.put(&simulation.take());
            assert_eq!(fresh.state_hash(), simulation.state_hash());
            for other in [&mut simulation, &mut fork, &mut fresh] {
                go(other, STEPS);
            }
            let expected = simulation.state_hash();
            assert_eq!([fork.state_hash(), fresh.state_hash()], [expected; 2]);
        }
    });
}

#[test]
fn a_way_changes_the_hash_and_a_scene_without_one_keeps_its_own() {
    with_threads(1, || {
        let mut still = cloth();
        still.colliders.iter_mut().for_each(|collider| collider.way = None);
        let (still, moving) = (still.simulate(Precision::F64), cloth().simulate(Precision::F64));
        assert_ne!(still.state_hash(), moving.state_hash());
        let mut called = still.fork();
        called.apply(&[call()]).expect("a ball may move");
        assert_ne!(called.state_hash(), still.state_hash());
        let mut none = still.fork();
        none.apply(&[Change::Gravity([0.0, -9.81, 0.0])]).expect("as before");
        assert_eq!(none.state_hash(), still.state_hash());
        called.apply(&[Change::Reset]).expect("a reset");
        assert_eq!(called.state_hash(), still.state_hash(), "a reset takes the way back");
    });
}
