//! The same bits where cloth meets solids of triangles: over threads, ranks and forks, and whatever was known before of how far
//! a particle is.

use std::sync::Arc;

use nappe_cluster::Cluster;
use nappe_sim::{
    cloth::{Hessian, Integrator, OnPass},
    collide::Collider,
    linalg::SolverSettings,
    math::Precision,
    report::NoStopwatch,
    world::{Change, Simulation},
};
use nappe_tests::{
    Method, Scene,
    meshes::{Surface, icosphere, torus},
    networks::{sheet, sheet_rules},
    ranks::on_ranks,
    scene::advance,
    threads::with_threads,
};

use crate::scenes::{STEPS, scene};

/// Steps of 2 ms in which a sheet comes from 3 cm above a ring, and lies on it for a while.
const FALL: u64 = 80;

/// Methods of either kind, and one that goes on from the past.
fn methods() -> [Method; 3] {
    [Integrator::SymplecticEuler, Integrator::ImplicitEuler, Integrator::Bdf2]
        .map(|integrator| Method::new(integrator, Hessian::Absolute))
}

/// A ring of one part that lies level.
fn ring() -> Surface {
    torus([0.01, -0.08, 0.02], 0.25, 0.08, [32, 16])
}

/// A ring and a ball that overlap, each a part.
fn ring_and_ball() -> Surface {
    Surface::joined(&[ring(), icosphere([0.2, -0.1, 0.0], 0.12, 2)])
}

/// A sheet that falls on a solid that moves: most of it is far from the solid at first, and some of it always.
fn falling(method: Method, solid: &Surface) -> Scene {
    let mut network = sheet(20, 0.05, &sheet_rules(100.0, 0.02), 0.005);
    network.pins.clear();
    network.x.iter_mut().for_each(|x| *x = [x[0] - 0.475, 0.035 + 0.05 * x[0], x[2] - 0.475]);
    let solid = solid.collider(0.4, 0.005);
    let mut scene = Scene::new(network, 2e-3).by(method).under([0.0, -9.81, 0.0]);
    scene.settings.block_size = 64;
    scene.settings.solver = SolverSettings::default();
    scene.colliders = vec![Collider { velocity: [0.3, 0.2, -0.1], ..solid }];
    scene
}

/// Scenes with a solid, by name, with their steps.
fn scenes() -> Vec<(String, Scene, u64)> {
    let of = |method: Method| {
        let name = method.name();
        [
            (format!("a tray, {name}"), scene("sheet_in_tray", method), STEPS),
            (format!("a ring, {name}"), falling(method, &ring()), FALL),
            (format!("a ring and a ball, {name}"), falling(method, &ring_and_ball()), FALL),
        ]
    };
    methods().into_iter().flat_map(of).collect()
}

/// The simulation after so many steps, in which particles must touch the solid.
fn stepped(scene: &Scene, precision: Precision, steps: u64) -> Simulation {
    let mut simulation = scene.simulate(precision);
    let touched: u64 = (0..steps).map(|_| advance(&mut simulation, 1).contact_count).sum();
    assert!(touched > 20, "{touched} contacts");
    simulation
}

#[test]
fn cloth_on_a_solid_has_the_same_bits_for_1_to_4_threads_and_1_to_3_ranks() {
    for (name, scene, steps) in scenes() {
        let setup = scene.setup();
        for precision in Precision::ALL {
            let alone = with_threads(1, || stepped(&scene, precision, steps).state_hash());
            for threads in 2..=4 {
                let hash = with_threads(threads, || stepped(&scene, precision, steps).state_hash());
                assert_eq!(hash, alone, "{name} in {precision} on {threads} threads");
            }
            for size in 1..=3 {
                let work = |ranks: Arc<dyn Cluster>| {
                    let (mut simulation, _) = Simulation::over(&setup, precision, ranks).expect("it is in");
                    (0..steps).for_each(|_| drop(simulation.step(&mut NoStopwatch).expect("it is stable")));
                    let (mut whole, _) = Simulation::new(&setup, precision).expect("it is in");
                    whole.put(&simulation.take());
                    whole.state_hash()
                };
                let hash = on_ranks(size, 1, work)[0].0;
                assert_eq!(hash, alone, "{name} in {precision} on {size} ranks");
            }
        }
    }
}

#[test]
fn a_fork_of_cloth_on_a_solid_goes_on_with_the_same_bits() {
    for (name, scene, steps) in scenes() {
        let whole = stepped(&scene, Precision::F32, steps).state_hash();
        let mut before = scene.simulate(Precision::F32);
        for at in 1..steps {
            advance(&mut before, 1);
            if at % (steps / 5) == 0 {
                let mut fork = before.fork();
                advance(&mut fork, steps - at);
                assert_eq!(fork.state_hash(), whole, "{name}, forked after step {at}");
            }
        }
        advance(&mut before, 1);
        assert_eq!(before.state_hash(), whole, "{name}, after its forks");
    }
}

/// Takes each step in a simulation that was built for it, and that knows nothing but the state.
fn one_step_each(scene: &Scene, from: &Simulation, steps: u64) -> u64 {
    let mut state = from.take();
    let mut hash = from.state_hash();
    for _ in 0..steps {
        let mut fresh = scene.simulate(from.precision());
        fresh.put(&state);
        advance(&mut fresh, 1);
        (state, hash) = (fresh.take(), fresh.state_hash());
    }
    hash
}

#[test]
fn what_was_known_of_distances_changes_no_bit() {
    for (name, scene, steps) in scenes() {
        let mut reject = scene.clone().certified();
        reject.settings.on_pass = OnPass::Reject;
        // Half of the steps are long enough to be taken again shorter.
        reject.dt *= 4.0;
        for (kind, scene, steps) in [("all steps", scene, steps), ("certified steps", reject, steps / 4)] {
            let whole = stepped(&scene, Precision::F64, steps).state_hash();
            let start = scene.simulate(Precision::F64);
            assert_eq!(one_step_each(&scene, &start, steps), whole, "{name}, {kind}");
        }
    }
}

#[test]
fn cloth_that_is_put_elsewhere_meets_a_solid_at_once() {
    for method in methods() {
        let mut scene = falling(method, &ring());
        let near = scene.network.x.clone();
        // So far away that nobody asks for a while.
        scene.network.x.iter_mut().for_each(|x| x[1] += 30.0);
        let fall = Some(vec![[0.3, -2.0, 0.0]; near.len()].into());
        let put = Change::State { body: "body".to_owned(), positions: near.into(), velocities: fall };
        let mut simulation = scene.simulate(Precision::F64);
        advance(&mut simulation, 10);
        simulation.apply(&[put, Change::Gravity([0.0, -20.0, 0.0])]).expect("it is accepted");
        let expected = one_step_each(&scene, &simulation, FALL);
        let touched: u64 = (0..FALL).map(|_| advance(&mut simulation, 1).contact_count).sum();
        assert!(touched > 20, "{}: {touched} contacts", method.name());
        assert_eq!(simulation.state_hash(), expected, "{}", method.name());
    }
}
