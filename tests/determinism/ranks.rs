//! The same bits over ranks, which are threads here: every run of cloth that several ranks can step.

use std::sync::Arc;

use nappe_cluster::Cluster;
use nappe_sim::{
    cloth::{Hessian, Integrator, Minimizer, NewtonSettings, OnPass, StateLimits},
    collide::{Collider, Contact, Shape, StartInside, shape::Sphere},
    linalg::{OperatorKind, Stop},
    math::Precision,
    parallel::Communicator,
    report::{NoStopwatch, StepFailure},
    world::{Change, Forces, Simulation},
};
use nappe_tests::{
    Method, Scene,
    networks::{chain, scatter, sheet, sheet_rules},
    ranks::{Counts, DIVIDES_FROM, on_ranks, on_ranks_that_divide},
    scene::advance,
};

use crate::{
    hashes::{committed, runs},
    scenes::{STEPS, changes, scene},
};

/// Numbers of ranks over which results must not change.
const RANK_COUNTS: [usize; 4] = [2, 3, 4, 7];

/// Steps a scene as one of several ranks; its state, whole on rank 0, in a simulation of its own.
fn run(name: &str, method: Method, precision: Precision, communicator: Arc<dyn Communicator>) -> u64 {
    let setup = scene(name, method).setup();
    let (mut simulation, _) = Simulation::over(&setup, precision, communicator).expect("it is in");
    simulation.apply(&changes(name)).expect("changes of the scene");
    for _ in 0..STEPS {
        simulation.step(&mut NoStopwatch).expect("it is stable");
    }
    let (mut whole, _) = Simulation::new(&setup, precision).expect("it is in");
    whole.put(&simulation.take());
    whole.state_hash()
}

#[test]
fn every_run_has_its_committed_hash_over_ranks() {
    let committed = committed();
    let mut compared = 0;
    let divided =
        runs().into_iter().filter(|(_, name, method, _)| !method.is_by_sweeps() && *name != "soft_functions");
    for (index, (key, name, method, precision)) in divided.enumerate() {
        // What ranks divide or all do alike.
        let ways = if name == "coarse_spaces" { &DIVIDES_FROM[..] } else { &DIVIDES_FROM[..1] };
        for (size, divides_from) in
            RANK_COUNTS.iter().flat_map(|size| ways.iter().map(move |way| (*size, *way)))
        {
            // By turns, so that each count of ranks has one thread in half of the runs of each precision, two in the others.
            let threads = 1 + (index + index / 2 + size) % 2;
            let work = |ranks: Arc<dyn Cluster>| run(name, method, precision, ranks);
            let hash = on_ranks_that_divide(divides_from, size, threads, work)[0].0;
            assert_eq!(committed.get(&key), Some(&hash), "{key} on {size} ranks of {threads} threads");
            compared += 1;
        }
    }
    assert!(compared > 150, "{compared} runs");
}

#[test]
fn a_state_forces_and_a_reset_over_ranks_are_those_of_one_process() {
    let method = Method::all().into_iter().find(|method| method.integrator == Integrator::Bdf2);
    let scene = scene("sheet_in_air", method.expect("a method"));
    let elsewhere: Vec<[f64; 3]> = scene.network.x.iter().map(|[x, y, z]| [*x, y + 0.1 * x, *z]).collect();
    let state = Change::State { body: "body".to_owned(), positions: elsewhere.into(), velocities: None };
    let pull = |particles: &[u32], force: [f64; 3]| Change::Force {
        body: "body".to_owned(),
        particles: particles.into(),
        forces: Forces::One(force),
    };
    let on_all = [state, pull(&[], [0.01, 0.02, -0.01])];
    let on_few = [pull(&[], [0.0; 3]), pull(&[30, 215, 390], [-0.02, 0.01, 0.03])];
    let on_none = [Change::Reset];
    let parts: [&[Change]; 4] = [&[], &on_all, &on_few, &on_none];
    let go = |simulation: &mut Simulation| {
        simulation.apply(&changes("sheet_in_air")).expect("a force");
        for part in parts {
            simulation.apply(part).expect("accepted");
            (0..5).for_each(|_| drop(simulation.step(&mut NoStopwatch).expect("it is stable")));
        }
    };
    let mut alone = scene.simulate(Precision::F32);
    go(&mut alone);
    for size in RANK_COUNTS {
        let work = |ranks: Arc<dyn Cluster>| {
            let (mut simulation, _) =
                Simulation::over(&scene.setup(), Precision::F32, ranks).expect("it is in");
            go(&mut simulation);
            let mut whole = scene.simulate(Precision::F32);
            whole.put(&simulation.take());
            whole.state_hash()
        };
        assert_eq!(on_ranks(size, 2, work)[0].0, alone.state_hash(), "{size} ranks");
    }
}

/// Steps of scenes that fail, unless they fail before.
const STEPS_OF_TROUBLE: u64 = 30;

/// Steps a scene until it fails, alone or as one of several ranks: all that it reports, and how it ended.
pub(crate) fn failure(
    scene: &Scene,
    changes: &[Change],
    steps: u64,
    communicator: Option<Arc<dyn Cluster>>,
) -> String {
    let setup = scene.setup();
    let made = match communicator {
        Some(ranks) => Simulation::over(&setup, Precision::F64, ranks),
        None => Simulation::new(&setup, Precision::F64),
    };
    let mut simulation = match made {
        Ok((simulation, _)) => simulation,
        Err(error) => return error.to_string(),
    };
    simulation.apply(changes).expect("changes are accepted");
    let mut said = Vec::new();
    for _ in 0..steps {
        match simulation.step(&mut NoStopwatch) {
            Ok(report) => said.push(format!("{report:?}")),
            Err(error) => {
                said.push(error.to_string());
                break;
            }
        }
    }
    said.join("\n")
}

/// A sheet of ten blocks that spins.
pub(crate) fn spinning(omega: f64, stiffness: f64) -> Scene {
    spinning_of(17, omega, stiffness)
}

/// The same with so many particles along a side; by one solve per step.
pub(crate) fn spinning_of(side: usize, omega: f64, stiffness: f64) -> Scene {
    let mut network = sheet(side, 0.05, &sheet_rules(stiffness, 0.0), 0.01);
    network.pins.clear();
    for (x, v) in network.x.iter().zip(&mut network.v) {
        *v = [-omega * (x[2] - 0.4), 0.0, omega * (x[0] - 0.4)];
    }
    let mut scene = Scene::new(network, 1.0 / 60.0);
    scene.settings.minimizer = Minimizer::OneStep;
    scene.settings.block_size = 32;
    scene
}

/// A sheet, of so many particles along a side, that falls through a ball in one step.
pub(crate) fn falling_of(side: usize) -> Scene {
    let mut falling = spinning_of(side, 0.5, 100.0).under([0.0, -9.81, 0.0]).certified();
    let ball = Sphere { center: [0.43, -0.201, 0.4], radius: 0.2 };
    falling.colliders = vec![Collider {
        name: "ball".to_owned(),
        shape: Shape::Sphere(ball),
        velocity: [0.0; 3],
        way: None,
        friction: 0.3,
        restitution: 0.0,
        margin: 0.001,
        contact: Contact::default(),
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::Warn,
    }];
    falling.settings.on_pass = OnPass::Reject;
    // A shell that is thinner than a step is long.
    falling.network.v.iter_mut().for_each(|v| v[1] = -60.0);
    falling
}

/// A chain of so many particles, and two pins of it that are drawn apart by more than its limit allows.
pub(crate) fn drawn_of(count: u32) -> (Scene, Change) {
    let x: Vec<_> = (0..count).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect();
    let mut network = chain(&x, 0.1, 100.0, 0.0, 0.01);
    network.pins = vec![40, 44];
    let mut drawn = Scene::new(network, 0.01).certified();
    drawn.settings.block_size = 32;
    drawn.settings.limits.max_stretch = Some(1.5);
    (drawn, Change::Pin { particle: 44, target: [4.9, 0.0, 0.0], duration: 0.01 })
}

/// Scenes that fail or are divided, each in another way, with a part of what they say.
fn troubled() -> Vec<(&'static str, Scene, Vec<Change>)> {
    let symplectic = Method::new(Integrator::SymplecticEuler, Hessian::Absolute);
    let mut far = spinning(3.0, 500.0).by(symplectic);
    far.network.masses[200] = 1e-16;
    let mut stretched = spinning(30.0, 50.0).by(symplectic);
    stretched.dt = 1e-3;
    stretched.settings.limits.max_stretch = Some(1.2);
    let mut fast = stretched.clone();
    fast.settings.limits = StateLimits { max_stretch: None, max_energy: Some(1.0) };
    let mut gains =
        spinning(1.0, 500.0).by(Method::new(Integrator::ExplicitEuler, Hessian::Absolute)).certified();
    gains.network.drag = 1e-4;
    let mut inaccurate = spinning(30.0, 1e4).certified();
    inaccurate.settings.tolerance = Some(1e-9);
    let squeezed = |side: usize| {
        let mut scene = spinning_of(side, 0.0, 200.0).certified();
        for (i, x) in scene.network.x.iter_mut().enumerate() {
            *x = [0.7 * x[0], 1e-3 * scatter(i), 0.7 * x[2]];
        }
        scene.dt = 0.05;
        scene
    };
    let mut indefinite = squeezed(17);
    indefinite.settings.hessian = Hessian::Full;
    // It buckles by way of a saddle.
    let mut buckled = squeezed(9);
    buckled.settings.minimizer = Minimizer::Newton(NewtonSettings { tolerance: 0.1, max_iterations: 6 });

    // It goes on where one solve is not enough: to the end of the step, and to the last solve that it may make.
    let going_on = |omega: f64, stiffness: f64, accuracy: f64| {
        let mut scene = spinning(omega, stiffness).certified();
        scene.settings.minimizer = Minimizer::Auto { accuracy };
        scene
    };

    let (drawn, draw) = drawn_of(150);
    vec![
        ("became NaN", far, Vec::new()),
        ("times its rest length", stretched, Vec::new()),
        ("kinetic and elastic energy came to", fast, Vec::new()),
        ("the bound 'damping'", gains, Vec::new()),
        ("Descent", spinning(30.0, 1e6).certified(), Vec::new()),
        ("has an estimated error of", inaccurate, Vec::new()),
        ("Passed", falling_of(17), Vec::new()),
        ("Descent", indefinite, Vec::new()),
        ("EnergyGain", spinning(10.0, 1e4).certified(), Vec::new()),
        ("StepReport", buckled, Vec::new()),
        ("StepReport", going_on(10.0, 1e4, Minimizer::DEFAULT_ACCURACY), Vec::new()),
        ("Missed", going_on(30.0, 1e6, 1e-15), Vec::new()),
        ("the cloth from particle 43 to 44", drawn, vec![draw]),
    ]
}

#[test]
fn what_fails_or_is_rejected_says_the_same_over_ranks() {
    for (name, scene, changes) in troubled() {
        let alone = failure(&scene, &changes, STEPS_OF_TROUBLE, None);
        assert!(alone.contains(name), "{name}: {alone}");
        for size in [2, 5] {
            let work = |ranks| failure(&scene, &changes, STEPS_OF_TROUBLE, Some(ranks));
            for (over, _) in on_ranks(size, 1, work) {
                assert_eq!(over, alone, "{name} on {size} ranks");
            }
        }
    }
}

#[test]
fn an_interrupt_of_one_rank_ends_all_at_the_same_step() {
    for method in [
        Method::new(Integrator::VelocityVerlet, Hessian::Absolute),
        Method::new(Integrator::ImplicitEuler, Hessian::Absolute),
    ] {
        let setup = spinning(1.0, 500.0).by(method).in_substeps(8).setup();
        let work = |ranks: Arc<dyn Cluster>| {
            let rank = ranks.rank();
            let (mut simulation, _) = Simulation::over(&setup, Precision::F32, ranks).expect("it is in");
            loop {
                if rank == 1 && simulation.step_count() == 3 {
                    simulation.interrupt().request();
                }
                if let Err(error) = simulation.step(&mut NoStopwatch) {
                    break (error.step, error.failure);
                }
            }
        };
        for (end, _) in on_ranks(3, 1, work) {
            assert_eq!(end, (3, StepFailure::Interrupted), "{}", method.name());
        }
    }
}

#[test]
fn what_is_out_is_refused_by_its_name() {
    let scene = spinning(1.0, 500.0);
    let refused = |scene: &Scene| {
        let setup = scene.setup();
        let all = on_ranks(2, 1, |ranks| {
            Simulation::over(&setup, Precision::F32, ranks).expect_err("it is out").to_string()
        });
        all[0].0.clone()
    };
    let mut assembled = scene.clone();
    assembled.settings.solver.operator = OperatorKind::Assembled;
    for (scene, what) in [
        (scene.by(Method::by_sweeps(Integrator::Bdf2, 5)), "minimizer = \"vertex_block_descent\""),
        (assembled, "operator = \"assembled\""),
    ] {
        let message = refused(&scene);
        assert!(message.contains("'body'") && message.contains(what), "{message}");
    }
}

/// What each rank asks of the others in the step after some.
fn asked(scene: &Scene, size: usize, steps: u64) -> Vec<Counts> {
    asked_of(64, scene, size, steps)
}

/// The same of ranks that divide work on a coarse space from so many blocks on.
pub(crate) fn asked_of(divides_from: usize, scene: &Scene, size: usize, steps: u64) -> Vec<Counts> {
    let setup = scene.setup();
    let after = |steps: u64| {
        on_ranks_that_divide(divides_from, size, 1, |ranks| {
            let (mut simulation, _) = Simulation::over(&setup, Precision::F32, ranks).expect("it is in");
            for _ in 0..steps {
                simulation.step(&mut NoStopwatch).expect("it is stable");
            }
        })
    };
    let (before, after) = (after(steps), after(steps + 1));
    let difference = |(((), before), ((), after)): (&((), Counts), &((), Counts))| Counts {
        gathers: after.gathers - before.gathers,
        told: after.told - before.told,
        exchanges: after.exchanges - before.exchanges,
        messages: after.messages - before.messages,
        bytes: after.bytes - before.bytes,
        given: after.given,
    };
    before.iter().zip(&after).map(difference).collect()
}

#[test]
fn a_step_asks_as_much_as_its_formula_says() {
    for k in [1, 4, 10] {
        let mut scene = spinning(1.0, 500.0);
        scene.settings.solver.stop = Stop::Iterations(k);
        for counts in asked(&scene, 3, 2) {
            assert_eq!((counts.exchanges, counts.gathers), (u64::from(k) + 1, 2 * u64::from(k) + 4), "{k}");
        }
    }
    // Where convergence is checked the residual is computed once more.
    let mut scene = spinning(1.0, 500.0);
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-3, max_iterations: 200 };
    let mut alone = scene.simulate(Precision::F32);
    let solve = advance(&mut alone, 3).solve.expect("a solve");
    let k = u64::from(solve.iterations);
    for counts in asked(&scene, 3, 2) {
        assert_eq!((counts.exchanges, counts.gathers), (k + 2, 2 * k + 5), "{solve:?}");
    }
}

#[test]
fn ghosts_are_as_few_as_the_order_of_particles_makes_them() {
    let network = sheet(400, 0.01, &sheet_rules(100.0, 0.0), 1e-4);
    let scene = Scene::new(network, 1e-5).by(Method::new(Integrator::SymplecticEuler, Hessian::Absolute));
    for (size, most) in [(2, 3_600), (4, 6_600)] {
        let bytes: u64 = asked(&scene, size, 0).iter().map(|counts| counts.bytes).sum();
        // The first step evaluates its start and its end: positions and velocities, 24 bytes per ghost.
        let ghosts = bytes / 48;
        assert!(ghosts <= most && ghosts > most / 2, "{ghosts} on {size} ranks");
    }
}
