//! One spring at the edge of stability, and the closed forms of the critical steps.

use nappe_sim::{cloth::Integrator, math::Precision};
use nappe_tests::{
    Method, ScalarLaw, Scene,
    golden::table,
    networks::chain,
    scene::{positions, try_advance},
};

/// Frequency of the spring of these tests (rad/s).
const OMEGA: f64 = 20.0;

/// The critical step of an integrator for a damping ratio: its closed form, 0 if every step grows;
/// `None` without a limit.
fn closed_form(integrator: Integrator, ratio: f64) -> Option<f64> {
    match integrator {
        Integrator::ExplicitEuler if ratio < 1.0 => Some(2.0 * ratio / OMEGA),
        Integrator::ExplicitEuler => Some(2.0 / (OMEGA * (ratio + (ratio * ratio - 1.0).sqrt()))),
        Integrator::SymplecticEuler => Some(2.0 / OMEGA * ((1.0 + ratio * ratio).sqrt() - ratio)),
        Integrator::VelocityVerlet | Integrator::VelocityVerletPredicted => {
            law(ratio).critical_step(integrator, 1.0)
        }
        Integrator::ImplicitEuler | Integrator::ImplicitMidpoint | Integrator::Bdf2 => None,
    }
}

fn law(ratio: f64) -> ScalarLaw {
    ScalarLaw { stiffness: OMEGA * OMEGA, damping: 2.0 * ratio * OMEGA, force: 0.0 }
}

#[test]
fn closed_forms_agree_with_the_eigenvalues_of_a_step() {
    for integrator in [Integrator::ExplicitEuler, Integrator::SymplecticEuler] {
        for ratio in [0.05, 0.2, 0.7, 1.5] {
            let expected = closed_form(integrator, ratio).expect("a limit");
            let found = law(ratio).critical_step(integrator, 1.0).expect("a limit");
            assert!(
                (found / expected - 1.0).abs() < 1e-6,
                "{integrator:?}, {ratio}: {found} s, not {expected}"
            );
        }
    }

    // Kick, drift, kick: (1 + b) h² w² <= 4 (1 + b²), b = 1 - h c / 2, and |b| <= 1.
    for row in table("stability/critical_dt.csv") {
        let omega = row.number("omega_max_rad_s");
        let damping = row.number("nu") / 15_000.0 * omega * omega;
        let law = ScalarLaw { stiffness: omega * omega, damping, force: 0.0 };
        for (integrator, column) in [
            (Integrator::SymplecticEuler, "dt_crit_symplectic_euler_s"),
            (Integrator::ExplicitEuler, "dt_crit_explicit_euler_s"),
        ] {
            let expected = row.number(column);
            let found = if expected == 0.0 {
                // Every step grows.
                assert!(law.spectral_radius(integrator, 1e-6) > 1.0);
                continue;
            } else {
                law.critical_step(integrator, 10.0 / omega).expect("a limit")
            };

            // The table takes the least over all modes: for explicit Euler nu / k while the top
            // mode is underdamped, 2 ratio / omega here.
            assert!(
                (found / expected - 1.0).abs() < 1e-4,
                "{row:?}, {integrator:?}: {found} s, not {expected}"
            );
        }
    }
}

/// Growth of a small displacement over `count` steps.
fn growth(method: Method, ratio: f64, dt: f64, count: u64) -> f64 {
    let amplitude = 1e-9;
    let mut network =
        chain(&[[0.0; 3], [1.0 + amplitude, 0.0, 0.0]], 1.0, OMEGA * OMEGA, 2.0 * ratio * OMEGA, 1.0);
    network.pins = vec![0];
    let mut simulation = Scene::new(network, dt).by(method).simulate(Precision::F64);

    // The largest of the last steps: a mode may pass through 0.
    let mut largest: f64 = 0.0;
    if try_advance(&mut simulation, count).is_err() {
        return f64::INFINITY;
    }

    for _ in 0..20 {
        if try_advance(&mut simulation, 1).is_err() {
            return f64::INFINITY;
        }

        largest = largest.max((positions(&simulation)[1][0] - 1.0).abs());
    }

    largest / amplitude
}

#[test]
fn a_spring_is_stable_just_below_its_critical_step_and_not_just_above() {
    for method in Method::all() {
        for ratio in [0.0, 0.1, 0.3, 1.0] {
            let label = format!("{}, damping ratio {ratio}", method.name());
            let Some(critical) = closed_form(method.integrator, ratio) else {
                // No limit: even at a thousand times the others' the motion dies, or keeps its energy.
                let most = if method.integrator == Integrator::ImplicitMidpoint { 1.0 + 1e-6 } else { 1e-3 };
                assert!(growth(method, ratio, 2000.0 / OMEGA, 100) < most, "{label}");
                continue;
            };

            if critical == 0.0 {
                assert!(growth(method, ratio, 0.02 / OMEGA, 100_000) > 1000.0, "{label}: grows at any step");
                continue;
            }

            let count = 200_000;
            assert!(growth(method, ratio, 0.999 * critical, count) < 50.0, "{label}: below");

            // By the power of its eigenvalue, however slowly.
            let rate = law(ratio).spectral_radius(method.integrator, 1.001 * critical);
            let expected = rate.powf(count as f64);
            assert!(expected > 50.0, "{label}: {expected}");
            let found = growth(method, ratio, 1.001 * critical, count);
            assert!(found > 0.1 * expected.min(1e4), "{label}: above, {found} of {expected}");
        }
    }
}
