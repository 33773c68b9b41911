//! Forces and accelerations of a state, as frames show them: at rest, by what changes momenta in explicit and implicit steps, and
//! with the same bits for any number of threads.

use nappe_sim::{
    cloth::{Hessian, Integrator},
    field::Field,
    math::Precision,
    world::{Change, Forces, Simulation},
};
use nappe_tests::{
    Method, Scene,
    networks::{chain, scatter, sheet, sheet_rules},
    scene::{advance, difference, momenta, norm, velocities},
    threads::with_threads,
};

use crate::air::AIR;

/// Particles along a side of the sheet, two corners of which are pinned.
const SIDE: usize = 9;

fn vectors(simulation: &Simulation, field: Field) -> Vec<[f64; 3]> {
    let mut vectors = vec![[0.0; 3]; simulation.particle_count()];
    simulation.read::<f64>(field, vectors.as_flattened_mut());
    vectors
}

/// A sheet that moves every way, with springs of a damping (N s/m) and a drag (N s/m), in wind.
fn shaken(damping: f64, drag: f64) -> Scene {
    let mut network = sheet(SIDE, 0.05, &sheet_rules(200.0, damping), 0.01);
    for (i, (x, v)) in network.x.iter_mut().zip(&mut network.v).enumerate() {
        if i != 0 && i != SIDE - 1 {
            *x = [0, 1, 2].map(|c| x[c] + 0.004 * scatter(3 * i + c));
            *v = [0, 1, 2].map(|c| 0.3 * scatter(7 * i + c));
        }
    }
    network.drag = drag;
    let mut scene = Scene::new(network, 1e-4).under([0.3, -9.81, 0.0]);
    scene.wind = [2.0, 0.0, 1.0];
    scene
}

/// Sum of the forces (N) on all but the pins.
fn push(simulation: &Simulation) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (particle, force) in vectors(simulation, Field::Forces).iter().enumerate() {
        if particle != 0 && particle != SIDE - 1 {
            for c in 0..3 {
                sum[c] += force[c];
            }
        }
    }
    sum
}

#[test]
fn a_chain_that_hangs_at_rest_feels_nothing_but_its_weight_on_the_pin() {
    let (mass, stiffness, rest_length, gravity) = (0.03, 50.0, 0.1, 9.81);
    let (mut x, mut y) = (vec![[0.0; 3]], 0.0);
    for below in (1..20).rev() {
        y -= rest_length + f64::from(below) * mass * gravity / stiffness;
        x.push([0.0, y, 0.0]);
    }
    let mut network = chain(&x, rest_length, stiffness, 0.2, mass);
    network.pins = vec![0];
    for integrator in Integrator::ALL {
        let method = Method::new(integrator, Hessian::Absolute);
        let scene = Scene::new(network.clone(), 1e-3).by(method).under([0.0, -gravity, 0.0]);
        let simulation = scene.simulate(Precision::F64);
        let forces = vectors(&simulation, Field::Forces);
        let free = forces[1..].iter().map(|force| norm(*force)).fold(0.0, f64::max);
        assert!(free < 1e-9, "{}: {free} N on a particle at rest", method.name());
        let topology = simulation.topology();
        let weight = topology[0].masses.iter().sum::<f64>() * gravity;
        assert!((weight - 20.0 * mass * gravity).abs() < 1e-12, "{weight} N");
        let error = norm(difference(forces[0], [0.0, -weight, 0.0]));
        assert!(error < 1e-9, "{}: {:?} N on the pin of {weight} N", method.name(), forces[0]);
        let accelerations = vectors(&simulation, Field::Accelerations);
        assert_eq!(accelerations[0], [0.0; 3], "a pin");
        assert!(accelerations.iter().all(|a| norm(*a) < 1e-9 / mass));
    }
}

#[test]
fn the_forces_of_an_explicit_step_times_its_length_are_the_change_of_momentum() {
    for integrator in Integrator::ALL.into_iter().filter(|integrator| !integrator.is_implicit()) {
        let is_verlet =
            matches!(integrator, Integrator::VelocityVerlet | Integrator::VelocityVerletPredicted);
        // The second half of a step of Verlet has the velocities of its middle: forces there are those at its end
        // where they do not depend on velocities.
        let mut scene = if is_verlet { shaken(0.0, 0.0) } else { shaken(0.05, 0.01) };
        if !is_verlet {
            scene.network.air = Some(AIR);
        }
        let method = Method::new(integrator, Hessian::Absolute);
        let scene = scene.by(method);
        let mut simulation = scene.simulate(Precision::F64);
        let call = Change::Force {
            body: "body".to_owned(),
            particles: [5, 40].into(),
            forces: Forces::One([0.2, -0.1, 0.4]),
        };
        simulation.apply(&[call]).expect("a fair force");
        let masses = &scene.network.masses;
        for step in 0..20 {
            let (start, before) = (push(&simulation), momenta(&simulation, masses).0);
            advance(&mut simulation, 1);
            let gained = difference(momenta(&simulation, masses).0, before);
            let end = push(&simulation);
            let expected = [0, 1, 2].map(|c| {
                let force = if is_verlet { 0.5 * (start[c] + end[c]) } else { start[c] };
                scene.dt * force
            });
            let error = norm(difference(gained, expected));
            assert!(error < 1e-12, "{}, step {step}: {gained:?} N s, not {expected:?}", method.name());
            assert!(norm(gained) > 1e-5, "{}: something moves", method.name());
        }
    }
}

#[test]
fn the_forces_at_the_end_of_an_implicit_step_times_its_length_are_the_change_of_momentum() {
    let (dt, mass) = (0.01, 0.02);
    // Along a line the forces of springs are linear: one solve is exact.
    let x: Vec<_> = (0..20).map(|i| [0.0, -0.12 * f64::from(i), 0.0]).collect();
    let mut network = chain(&x, 0.1, 400.0, 0.3, mass);
    network.pins = vec![0];
    let method = Method::new(Integrator::ImplicitEuler, Hessian::Full);
    let mut simulation = Scene::new(network, dt).by(method).under([0.0, -9.81, 0.0]).simulate(Precision::F64);
    for step in 0..5 {
        let before = velocities(&simulation);
        advance(&mut simulation, 1);
        let (after, forces) = (velocities(&simulation), vectors(&simulation, Field::Forces));
        for (particle, ((old, new), force)) in before.iter().zip(&after).zip(&forces).enumerate().skip(1) {
            let needed = difference(*new, *old).map(|c| mass * c / dt);
            let error = norm(difference(needed, *force));
            assert!(error < 1e-9, "step {step}, particle {particle}: off by {error} N of {needed:?}");
        }
    }
}

#[test]
fn forces_and_accelerations_have_the_same_bits_for_any_number_of_threads() {
    let mut scene = shaken(0.05, 0.01);
    scene.network.air = Some(AIR);
    scene.settings.block_size = 32;
    for precision in Precision::ALL {
        let mut simulation = scene.simulate(precision);
        advance(&mut simulation, 3);
        let read = |threads| {
            let both = || [Field::Forces, Field::Accelerations].map(|field| vectors(&simulation, field));
            with_threads(threads, both)
        };
        let [forces, accelerations] = read(1);
        for threads in [2, 3, 8] {
            assert_eq!(read(threads), [forces.clone(), accelerations.clone()], "{threads} threads");
        }
        let rounding = if precision == Precision::F64 { 1e-12 } else { 1e-4 };
        for (particle, (force, a)) in forces.iter().zip(&accelerations).enumerate() {
            let is_pin = particle == 0 || particle == SIDE - 1;
            let expected = if is_pin { [0.0; 3] } else { force.map(|c| c / 0.01) };
            let error = norm(difference(*a, expected));
            assert!(error <= rounding * (1.0 + norm(expected)), "{particle}: {a:?}, not {expected:?} m/s²");
        }
    }
}
