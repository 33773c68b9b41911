//! The bound on damped steps of velocity Verlet: its own, from both sides.

use nappe_sim::{
    cloth::{Integrator, Network, SpringLaw, SpringRules},
    math::Precision,
    mesh::TriangleMesh,
};
use nappe_study::critical_step_of_all;
use nappe_tests::{
    Scene,
    networks::{chain, scatter},
    scene::advance,
};

const VERLET: [Integrator; 2] = [Integrator::VelocityVerlet, Integrator::VelocityVerletPredicted];

/// Stiffness (N/m) and mass (kg) of a chain whose fastest mode is as fast as that of an endless one, but for 0.02 %.
const CHAIN: [f64; 2] = [50.0, 0.01];

/// A chain of springs of one damping (N s/m), in line and at rest.
fn line(damping: f64) -> Network {
    let x: Vec<_> = (0..80).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect();
    let [stiffness, mass] = CHAIN;
    chain(&x, 0.1, stiffness, damping, mass)
}

/// The bound (s) on the steps of an integrator.
fn bound(network: &Network, integrator: Integrator) -> f64 {
    let mut scene = Scene::new(network.clone(), 1e-3);
    scene.settings.integrator = integrator;
    scene.simulate(Precision::F64).step_bounds()[0].dt
}

#[test]
fn the_bound_of_velocity_verlet_is_that_of_its_two_regions_and_below_the_largest_stable_step() {
    let [stiffness, mass] = CHAIN;
    let omega = (4.0 * stiffness / mass).sqrt();
    for ratio in [0.0, 0.05, 0.2, 0.5, 1.0, 2.0, 5.0] {
        // Of the fastest mode: c = w² nu / k.
        let damping = 2.0 * ratio * omega * stiffness / (omega * omega);
        let network = line(damping);
        let c = 2.0 * ratio * omega;
        for integrator in VERLET {
            let [slope, stiff, damped] = if integrator == Integrator::VelocityVerlet {
                [0.5, 8.0 * 2_f64.sqrt() - 8.0, 4.0]
            } else {
                [1.0, 3.0, 2.0]
            };
            let line = 4.0 / (slope * c + ((slope * c).powi(2) + 4.0 * omega * omega).sqrt());
            let corner = (stiff.sqrt() / omega).min(damped / c);
            let expected = line.max(corner);
            let found = bound(&network, integrator);
            let label = format!("{integrator:?}, damping ratio {ratio}");
            // The largest eigenvalue is found from above, to 1 %.
            assert!(
                found <= expected * (1.0 + 1e-9) && found > 0.99 * expected,
                "{label}: {found} s, not {expected}"
            );

            let limit = critical_step_of_all(integrator, omega, damping / stiffness).expect("a limit");
            assert!(found <= limit * (1.0 + 1e-9), "{label}: {found} s, above {limit}");
            // For proportional damping the least of the region lies between its modes.
            assert!(found > 0.85 * limit, "{label}: {found} s, far below {limit}");
        }
    }
}

#[test]
fn velocity_verlet_may_take_longer_damped_steps_than_symplectic_euler() {
    let [stiffness, mass] = CHAIN;
    let omega = (4.0 * stiffness / mass).sqrt();
    for (ratio, most) in [(0.5, 1.47), (1.0, 2.19), (2.0, 2.11)] {
        let network = line(2.0 * ratio * stiffness / omega);
        let times =
            bound(&network, Integrator::VelocityVerlet) / bound(&network, Integrator::SymplecticEuler);
        assert!((times / most - 1.0).abs() < 0.02, "damping ratio {ratio}: {times} times as long");
    }
}

/// A sheet off its places, at rest, whose particles and kinds of springs differ in mass, stiffness and damping.
fn uneven(damping: f64) -> Network {
    let mut mesh = TriangleMesh::grid(9, 9, 0.1);
    for (i, [x, y, z]) in mesh.points.iter_mut().enumerate() {
        *x += 0.03 * scatter(3 * i);
        *y += 0.03 * scatter(3 * i + 1);
        *z += 0.03 * scatter(3 * i + 2);
    }
    let law = |stiffness: f64, share: f64| SpringLaw { stiffness, damping: damping * share };
    let rules =
        SpringRules { stretch: law(200.0, 0.1), shear: Some(law(20.0, 1.0)), bend: Some(law(60.0, 0.0)) };
    let mut network = Network::from_lattice(&mesh, [9, 9], &rules, 0.01);
    network.masses.iter_mut().enumerate().for_each(|(i, m)| *m *= 3_f64.powf(scatter(i)));
    network.drag = 0.1 * damping;
    network
}

#[test]
fn what_moves_a_little_does_not_grow_at_the_bound_of_damped_velocity_verlet() {
    for damping in [0.0, 0.1, 0.5, 2.0, 10.0] {
        for integrator in VERLET {
            let mut network = uneven(damping);
            for (i, v) in network.v.iter_mut().enumerate() {
                *v = [0, 1, 2].map(|c| 1e-7 * scatter(3 * i + c));
            }
            let dt = 0.999 * bound(&network, integrator);
            let mut scene = Scene::new(network, dt);
            scene.settings.integrator = integrator;
            let mut simulation = scene.simulate(Precision::F64);
            let start = simulation.diagnose().total_energy();
            let end = advance(&mut simulation, 5000).diagnostics.total_energy();
            // Undamped, the energy of a mode at the limit swings by all of it; a growth of 0.1 % a step is one of 2e4.
            assert!(end < 1000.0 * start, "{integrator:?}, {damping}: {start:e} J, then {end:e} J");
        }
    }
}
