//! Newton's method where the first linear solve does not do: at a saddle, and where a full step leads too far.

use nappe_sim::{
    cloth::{Hessian, Integrator, Minimizer, NewtonSettings},
    linalg::Outcome,
    math::Precision,
};
use nappe_tests::{
    Method, NEWTON, Scene,
    networks::{chain, scatter, sheet, sheet_rules},
    scene::{advance, positions},
};

use crate::rippled::{a_rippled_sheet_converges, a_squeezed_sheet_buckles};

/// Two springs in line between held ends, pressed to 0.8 of their length.
const HALF_WIDTH: f64 = 0.8;

#[test]
fn a_line_under_compression_buckles_as_far_as_its_inertia_lets_it_in_one_step() {
    let (stiffness, mass, dt) = (100.0, 0.01, 0.1);
    for integrator in [Integrator::ImplicitEuler, Integrator::ImplicitMidpoint, Integrator::Bdf2] {
        let ends = [[-HALF_WIDTH, 0.0, 0.0], [0.0; 3], [HALF_WIDTH, 0.0, 0.0]];
        let mut network = chain(&ends, 1.0, stiffness, 0.0, mass);
        network.pins = vec![0, 2];
        let method = Method { minimizer: NEWTON, ..Method::new(integrator, Hessian::Absolute) };
        let mut simulation = Scene::new(network, dt).by(method).simulate(Precision::F64);
        advance(&mut simulation, 1);
        let [x, y, z] = positions(&simulation)[1];

        // Off the line by r, where the springs are l long: m r / g² = -2 k (1 - l0 / l) r. The midpoint is half-way there.
        let part = if integrator == Integrator::ImplicitMidpoint { 0.5 } else { 1.0 };
        let length = 1.0 / (1.0 + mass / (2.0 * stiffness * (part * dt).powi(2)));
        let expected = (length * length - HALF_WIDTH * HALF_WIDTH).sqrt() / part;
        assert!(x.abs() < 1e-9, "{}: {x:e} m along the line", integrator.name());
        assert!((y.hypot(z) - expected).abs() < 1e-9, "{}: {y} and {z}, not {expected} m", integrator.name());
    }
}

#[test]
fn a_crumpled_sheet_comes_to_rest_within_a_step_although_full_changes_overshoot() {
    // dt sqrt(k / m); the exact tangent is indefinite, and without a search along its changes they gain energy.
    for number in [2.0, 10.0, 200.0] {
        let (mass, dt) = (0.01, 0.01);
        let stiffness = mass * f64::powi(number / dt, 2);
        let mut network = sheet(6, 0.1, &sheet_rules(stiffness, 0.0), mass);
        for (i, x) in network.x.iter_mut().enumerate() {
            *x = [0, 1, 2].map(|c| x[c] * 0.8 + 0.03 * scatter(3 * i + c));
        }
        let method = Method { minimizer: NEWTON, ..Method::new(Integrator::ImplicitEuler, Hessian::Full) };
        let mut simulation = Scene::new(network, dt).by(method).simulate(Precision::F64);
        let before = simulation.diagnose().total_energy();
        let report = advance(&mut simulation, 1);
        let (after, solve) = (report.diagnostics.total_energy(), report.solve.expect("an implicit step"));
        assert_eq!(solve.outcome, Outcome::Converged, "{number}: {solve:?}");
        assert!(solve.relative_residual < 1e-12, "{number}: {solve:?}");
        assert!(after < 0.25 * before, "{number}: {before} J, then {after} J");
    }
}

#[test]
fn slow_motion_is_not_taken_for_none() {
    // Accelerations of 1e-4 m/s², a hundredth of the default tolerance. Along its spring the step is linear.
    let run = |minimizer| {
        let mut network = chain(&[[0.0; 3], [1.0 + 1e-6, 0.0, 0.0]], 1.0, 100.0, 0.0, 1.0);
        network.pins = vec![0];
        let method = Method { minimizer, ..Method::new(Integrator::ImplicitEuler, Hessian::Absolute) };
        let mut simulation = Scene::new(network, 0.01).by(method).simulate(Precision::F64);
        advance(&mut simulation, 30);
        positions(&simulation)[1][0] - 1.0
    };
    let (exact, found) = (run(Minimizer::OneStep), run(Minimizer::Newton(NewtonSettings::default())));
    assert!(exact.abs() < 0.99e-6, "it moves: {exact:e} m");
    assert!((found / exact - 1.0).abs() < 1e-6, "{found:e} m, not {exact:e}");
}

#[test]
fn a_step_of_a_rippled_sheet_ends_after_some_iterates() {
    a_rippled_sheet_converges([75, 65], 2, 15);
}

#[test]
fn a_sheet_buckles_in_waves_as_long_as_itself() {
    a_squeezed_sheet_buckles(48, 0.01);
}
