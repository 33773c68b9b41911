//! Explicit steps by the certified bound: divided where they need it, refused where they are fixed above it.

use nappe_sim::{
    cloth::{ClothSettings, Integrator, Network},
    math::Precision,
    report::{BoundKind, StepFailure},
    time_step::TimeStep,
    world::{SetupError, Simulation},
};
use nappe_tests::{
    Scene,
    networks::{DrapSprings, chain, drap},
    scene::{advance, try_advance},
};

const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];
const BOUNDED: [Integrator; 3] =
    [Integrator::SymplecticEuler, Integrator::VelocityVerlet, Integrator::VelocityVerletPredicted];

/// The course's cloth, with the damping of its springs (N s/m), in steps of `dt` (s).
fn course_cloth(dt: f64, damping: f64, integrator: Integrator, time_step: TimeStep) -> Scene {
    let mut scene = Scene::new(drap(10, DrapSprings::Faces, damping), dt).under(GRAVITY);
    scene.settings = ClothSettings { integrator, time_step, ..scene.settings };
    scene
}

fn refused(scene: &Scene) -> String {
    match Simulation::new(&scene.setup(), Precision::F64) {
        Err(SetupError::Body { body, message }) => format!("{body}: {message}"),
        other => panic!("it was accepted, or refused for {:?}", other.err()),
    }
}

#[test]
fn a_step_above_the_bound_is_divided_and_gains_no_energy() {
    for integrator in BOUNDED {
        for precision in Precision::ALL {
            for (dt, damping) in [(0.02, 0.01), (0.02, 50.0), (0.005, 1000.0)] {
                let label = format!("{} in {precision}, dt {dt} s, nu {damping}", integrator.name());
                let scene = course_cloth(dt, damping, integrator, TimeStep::default());
                let mut simulation = scene.simulate(precision);
                let start = simulation.diagnose().total_energy();
                for _ in 0..100 {
                    let bound = simulation.step_bounds()[0].clone();
                    let report = advance(&mut simulation, 1);
                    let steps = report.cloth.expect("a cloth");
                    // The bound before the step allows its first sub-step, the bound after it the next.
                    assert!(steps.dt <= 0.9 * bound.dt * 1.5, "{label}: {steps:?} after {bound:?}");
                    assert!(f64::from(steps.substeps) >= dt / bound.dt * 0.9, "{label}: {steps:?}");
                    let after = &simulation.step_bounds()[0];
                    let energy = report.diagnostics.total_energy();
                    let moved = report.diagnostics.kinetic_energy + report.diagnostics.elastic_energy;
                    assert!(energy - start < 0.5 * moved, "{label}: {} J gained of {moved}", energy - start);
                    if steps.bound.kind == BoundKind::SpringSpeed {
                        assert!(steps.bound.dt <= 0.9 * after.dt, "{label}: {steps:?}");
                        continue;
                    }
                    assert_eq!(steps.bound.kind, BoundKind::Stiffness, "{label}");
                    assert_eq!(steps.bound.particle, Some(after.particle), "{label}");
                    assert!((steps.bound.dt / (0.9 * after.dt) - 1.0).abs() < 1e-12, "{label}: {steps:?}");
                }
            }
        }
    }
}

#[test]
fn a_fixed_step_above_the_bound_is_refused_before_it_is_taken() {
    for integrator in BOUNDED {
        let message = refused(&course_cloth(0.01, 0.01, integrator, TimeStep::Fixed(f64::INFINITY)));
        assert!(
            message.contains("body: the time step of 1.0000e-2 s is above the bound 'stiffness'"),
            "{message}"
        );
        assert!(message.contains("at particle"), "{message}");
    }

    // Falling, it stretches: what is below the bound at the start is above it later.
    let fixed = TimeStep::Fixed(5.7e-3);
    let mut simulation =
        course_cloth(5.7e-3, 0.0, Integrator::SymplecticEuler, fixed).simulate(Precision::F64);
    let bound = simulation.step_bounds()[0].dt;
    assert!(bound > 5.7e-3, "{bound} s");
    let error = try_advance(&mut simulation, 400).expect_err("the bound falls");
    let StepFailure::TimeStep { dt, limit, bound: BoundKind::Stiffness, .. } = error.failure else {
        panic!("{error}")
    };
    assert!(error.step > 0 && limit < dt && (dt - 5.7e-3).abs() < 1e-12, "{error}");

    // Unchecked, it goes on; far above the bound, to where numbers end.
    let far = course_cloth(0.02, 0.0, Integrator::SymplecticEuler, TimeStep::Unchecked(0.02));
    let error = try_advance(&mut far.simulate(Precision::F64), 1000).expect_err("it diverges");
    assert!(matches!(error.failure, StepFailure::NotFinite { .. }), "{error}");
}

#[test]
fn a_fixed_step_in_which_springs_move_too_far_is_refused() {
    // Let go at twice its length, undamped: by sub-steps below the bound on stiffness it came from 47.5 J to 4.5e5 J.
    let x: Vec<_> = (0..20).map(|i| [0.2 * f64::from(i), 0.0, 0.0]).collect();
    let mut network = chain(&x, 0.1, 500.0, 0.0, 0.01);
    network.pins = vec![0];
    for integrator in BOUNDED {
        let dt = 1.0 / 240.0;
        let mut scene = Scene::new(network.clone(), 4.0 * dt);
        scene.settings = ClothSettings { integrator, time_step: TimeStep::Fixed(dt), ..scene.settings };
        let mut simulation = scene.simulate(Precision::F64);
        let start = simulation.diagnose().total_energy();
        assert!(simulation.step_bounds()[0].dt > dt, "{integrator:?}: stiffness allows it at the start");
        let error = try_advance(&mut simulation, 200).expect_err("its springs move too far");
        let StepFailure::TimeStep { dt: refused, limit, bound: BoundKind::SpringSpeed, .. } = error.failure
        else {
            panic!("{integrator:?}: {error}")
        };
        assert!((refused - dt).abs() < 1e-12 && limit < dt, "{integrator:?}: {error}");
        let end = simulation.diagnose().total_energy();
        assert!(end < 1.1 * start, "{integrator:?}: {start} J came to {end} J before");
    }
}

/// A particle of 1 kg on a spring with a stiffness (N/m) and a damping (N s/m), stretched by `stretch`, in a medium.
fn oscillator([stiffness, damping, drag]: [f64; 3], stretch: f64) -> Network {
    let mut network = chain(&[[0.0; 3], [stretch, 0.0, 0.0]], 1.0, stiffness, damping, 1.0);
    network.pins = vec![0];
    network.drag = drag;
    network
}

#[test]
fn explicit_euler_without_damping_says_that_no_step_is_stable() {
    let scene = |network| {
        let mut scene = Scene::new(network, 1e-3).certified();
        scene.settings.integrator = Integrator::ExplicitEuler;
        scene
    };
    let message = refused(&scene(oscillator([100.0, 0.0, 0.0], 1.0)));
    assert!(message.contains("no step is stable") && message.contains("symplectic_euler"), "{message}");
    // The damping of a spring does not reach what tension adds across it.
    let message = refused(&scene(oscillator([100.0, 1.0, 0.0], 1.1)));
    assert!(message.contains("no step is stable"), "{message}");

    // Damped, it takes steps that it bears: by theory up to c / w² = 10 ms of the spring, by drag 20 ms.
    for (numbers, stretch, theory) in [([100.0, 1.0, 0.0], 1.0, 0.01), ([100.0, 0.0, 4.0], 1.2, 0.04)] {
        let mut scene = scene(oscillator(numbers, stretch));
        scene.dt = 0.1;
        let mut simulation = scene.simulate(Precision::F64);
        let steps = advance(&mut simulation, 1).cloth.expect("a cloth");
        assert_eq!(steps.bound.kind, BoundKind::Damping);
        assert!(steps.dt <= theory && steps.dt > 0.4 * theory, "{steps:?}, by theory {theory} s");
        let start = simulation.diagnose().total_energy();
        let end = advance(&mut simulation, 200).diagnostics.total_energy();
        assert!(end <= start, "{start} J to {end} J");
    }
}

#[test]
fn a_run_whose_explicit_steps_gain_more_energy_than_their_method_swings_by_is_ended() {
    // The same chain, undamped, for long: by velocity Verlet springs that are pressed through their middle go on gaining.
    let x: Vec<_> = (0..20).map(|i| [0.2 * f64::from(i), 0.0, 0.0]).collect();
    let run = |integrator, damping| {
        let mut network = chain(&x, 0.1, 500.0, damping, 0.01);
        network.pins = vec![0];
        let mut scene = Scene::new(network, 1.0 / 60.0).certified();
        scene.settings.integrator = integrator;
        let mut simulation = scene.simulate(Precision::F64);
        let mut largest = simulation.diagnose().total_energy();
        for _ in 0..1000 {
            match try_advance(&mut simulation, 1) {
                Ok(report) => largest = report.diagnostics.total_energy().max(largest),
                Err(error) => return (largest, Some(error)),
            }
        }
        (largest, None)
    };
    for integrator in BOUNDED {
        let (largest, error) = run(integrator, 0.0);
        match error {
            None => assert!(largest < 1.2 * 47.5, "{integrator:?}: {largest} J"),
            Some(error) => {
                let StepFailure::EnergyGain { value, limit, .. } = error.failure else { panic!("{error}") };
                assert!(value > limit && error.step > 10, "{integrator:?}: {error}");
                // What a scene of 47.5 J may gain at the bound, and what comes within one more step.
                assert!(limit <= 47.5 && largest < 2.1 * 47.5, "{integrator:?}: {largest} J, {error}");
            }
        }
        let (largest, error) = run(integrator, 0.01);
        assert!(error.is_none() && largest <= 47.5 * (1.0 + 1e-12), "{integrator:?}: {largest} J, {error:?}");
    }
}
