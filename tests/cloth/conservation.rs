//! What must not change: momentum, angular momentum, and the energy of leapfrog within its bound.

use nappe_sim::{
    cloth::{Hessian, Integrator, Network},
    linalg::{PreconditionerKind, Stop},
    math::{Precision, Real},
};
use nappe_tests::{
    Method, Scene,
    networks::{chain, scatter, sheet, sheet_rules},
    scene::{advance, difference, momenta, norm},
};

/// A free sheet, shaken and thrown.
fn thrown(damping: f64) -> Network {
    let mut network = sheet(10, 0.1, &sheet_rules(200.0, damping), 0.01);
    network.pins.clear();
    for i in 0..network.x.len() {
        for c in 0..3 {
            network.x[i][c] += 0.01 * scatter(3 * i + c);
            network.v[i][c] = [0.5, -0.3, 0.8][c] + 0.3 * scatter(7 * i + c);
        }
    }
    network
}

/// Sum of the sizes of the momenta of the particles: the scale of the rounding of their sum.
fn momentum_scale(network: &Network) -> f64 {
    network.v.iter().zip(&network.masses).map(|(v, m)| m * norm(*v)).sum()
}

#[test]
fn springs_never_change_the_momentum() {
    for damping in [0.0, 0.05] {
        let network = thrown(damping);
        for method in Method::all() {
            for (precision, rounding) in [(Precision::F64, f64::ROUNDING), (Precision::F32, f32::ROUNDING)] {
                // Explicit Euler gains little energy at this step.
                let mut scene = Scene::new(network.clone(), 1e-4).by(method);
                if precision == Precision::F32 {
                    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-6, max_iterations: 200 };
                }

                let mut simulation = scene.simulate(precision);
                let before = simulation.diagnose().momentum;
                let count = 200;
                let after = advance(&mut simulation, count).diagnostics.momentum;

                // Each step rounds each velocity; the errors of a hundred particles add up at worst.
                let tolerance = 4.0 * rounding * count as f64 * momentum_scale(&network);
                let error = norm(difference(after, before));
                assert!(error < tolerance, "{} in {precision}: {error:e} of {tolerance:e}", method.name());
            }
        }
    }
}

#[test]
fn a_solve_cut_short_keeps_the_momentum_of_equal_masses() {
    // Translations stay eigenvectors of M + h D + h² K when all masses are equal.
    let network = thrown(0.05);
    for method in Method::all().into_iter().filter(|m| m.integrator.is_implicit()) {
        let mut scene = Scene::new(network.clone(), 1e-2).by(method);
        scene.settings.solver.stop = Stop::Iterations(3);
        scene.settings.solver.preconditioner = PreconditionerKind::Identity;
        let mut simulation = scene.simulate(Precision::F64);
        let before = simulation.diagnose().momentum;
        let after = advance(&mut simulation, 20).diagnostics.momentum;
        let error = norm(difference(after, before)) / momentum_scale(&network);
        assert!(error < 1e-13, "{}: {error:e}", method.name());
    }
}

/// Change of the angular momentum over 0.1 s, over its size.
fn turning_lost(method: Method, damping: f64, dt: f64) -> f64 {
    let network = thrown(damping);
    let mut simulation = Scene::new(network.clone(), dt).by(method).simulate(Precision::F64);
    let (_, before) = momenta(&simulation, &network.masses);
    advance(&mut simulation, (0.1 / dt).round() as u64);
    let (_, after) = momenta(&simulation, &network.masses);
    norm(difference(after, before)) / norm(before)
}

#[test]
fn kicks_and_drifts_never_change_the_angular_momentum() {
    for damping in [0.0, 0.05] {
        for integrator in
            [Integrator::SymplecticEuler, Integrator::VelocityVerlet, Integrator::VelocityVerletPredicted]
        {
            let lost = turning_lost(Method::new(integrator, Hessian::default()), damping, 1e-3);
            assert!(lost < 1e-12, "{integrator:?}: {lost:e}");
        }
    }
}

#[test]
fn euler_loses_angular_momentum_in_proportion_to_dt() {
    for method in Method::all() {
        if !matches!(method.integrator, Integrator::ExplicitEuler | Integrator::ImplicitEuler) {
            continue;
        }

        // The explicit one gains energy, so that it needs small steps to be near its limit.
        let dt = if method.integrator.is_implicit() { 2e-5 } else { 1e-5 };
        let ratio = turning_lost(method, 0.05, 2.0 * dt) / turning_lost(method, 0.05, dt);
        assert!((ratio - 2.0).abs() < 0.1, "{}: halving dt divides the loss by {ratio}", method.name());
    }
}

#[test]
fn leapfrog_keeps_the_energy_of_an_undamped_chain_within_its_bound() {
    // Velocity Verlet keeps v² + ω² x² (1 - y²/4) with y = ω dt, so E varies by at most y²/4 of it;
    // a bend in the chain adds terms of higher order: twice the bound is allowed for them.
    let (k, m) = (200.0, 0.02);
    let x: Vec<_> = (0..12).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect();
    let mut network = chain(&x, 0.08, k, 0.0, m);
    network.pins = vec![0, 11];
    for (i, v) in network.v.iter_mut().enumerate().take(11).skip(1) {
        *v = [0.1 * scatter(i), 0.1 * scatter(i + 20), 0.1 * scatter(i + 40)];
    }

    let omega = 2.0 * (k / m).sqrt();
    for (integrator, bound) in
        [(Integrator::VelocityVerlet, 0.25), (Integrator::VelocityVerletPredicted, 0.25)]
    {
        let dt = 0.2 / omega;
        let mut scene = Scene::new(network.clone(), dt);
        scene.settings.integrator = integrator;
        let mut simulation = scene.simulate(Precision::F64);
        let start = simulation.diagnose().total_energy();
        let motion = simulation.diagnose().kinetic_energy;
        for step in 0..20_000 {
            let energy = advance(&mut simulation, 1).diagnostics.total_energy();
            let change = (energy - start).abs() / motion;
            assert!(
                change < 2.0 * bound * 0.04,
                "{integrator:?}, step {step}: {change:e} of the motion's energy"
            );
        }
    }
}
