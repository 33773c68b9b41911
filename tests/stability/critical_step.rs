//! One spring at the edge of stability, and the closed forms of the critical steps against eigenvalues and golden data.

use nappe_sim::{cloth::Integrator, math::Precision};
use nappe_study::{critical_step, critical_step_of_all};
use nappe_tests::{
    Method, ScalarLaw, Scene,
    golden::table,
    networks::chain,
    scene::{positions, try_advance},
};

/// Frequency of the spring of these tests (rad/s).
const OMEGA: f64 = 20.0;

fn law(ratio: f64) -> ScalarLaw {
    ScalarLaw { stiffness: OMEGA * OMEGA, damping: 2.0 * ratio * OMEGA, force: 0.0 }
}

/// A mode of this frequency (rad/s) of springs of one damping over stiffness (s).
fn mode(frequency: f64, damping_time: f64) -> ScalarLaw {
    let stiffness = frequency * frequency;
    ScalarLaw { stiffness, damping: damping_time * stiffness, force: 0.0 }
}

const EXPLICIT: [Integrator; 4] = [
    Integrator::ExplicitEuler,
    Integrator::SymplecticEuler,
    Integrator::VelocityVerlet,
    Integrator::VelocityVerletPredicted,
];

#[test]
fn closed_forms_agree_with_the_eigenvalues_of_a_step() {
    for integrator in EXPLICIT {
        for ratio in [0.05, 0.2, 0.45, 0.7, 1.5] {
            let expected = critical_step(integrator, OMEGA, ratio).expect("a limit");
            let found = law(ratio).critical_step(integrator, 1.0).expect("a limit");
            assert!(
                (found / expected - 1.0).abs() < 1e-6,
                "{integrator:?}, {ratio}: {found} s, not {expected}"
            );
        }
        let undamped = critical_step(integrator, OMEGA, 0.0).expect("a limit");
        let expected = if integrator == Integrator::ExplicitEuler { 0.0 } else { 2.0 / OMEGA };
        assert!((undamped - expected).abs() < 1e-12, "{integrator:?}: {undamped} s, not {expected}");
    }
}

#[test]
fn the_least_of_all_modes_is_where_the_first_of_them_grows() {
    for integrator in EXPLICIT {
        for ratio in [1e-4, 0.01, 0.1, 0.3, 0.49, 0.52, 0.7, 1.0, 3.0, 10.0] {
            let damping_time = 2.0 * ratio / OMEGA;
            let found = critical_step_of_all(integrator, OMEGA, damping_time).expect("a limit");
            let grows = |dt: f64| {
                (1..=20_000).any(|i| {
                    let law = mode(OMEGA * f64::from(i) / 20_000.0, damping_time);
                    law.spectral_radius(integrator, dt) > 1.0 + 1e-13
                })
            };
            assert!(!grows(0.9999 * found), "{integrator:?}, {ratio}: a mode grows below {found} s");
            assert!(grows(1.0001 * found), "{integrator:?}, {ratio}: no mode grows above {found} s");
        }
    }
}

/// Rows of the table whose limit of velocity Verlet contradicts the condition at its head: it stands where 2 / w is, times
/// 1.00005, as if a scan had begun there. The test shows that no mode grows well beyond it.
const TOO_SHORT: [(&str, f64); 4] =
    [("drap10/faces", 100.0), ("drap10/full", 50.0), ("drap70/faces", 50.0), ("drap70/full", 50.0)];

#[test]
fn critical_steps_of_the_course_cloths_are_those_on_record() {
    for row in table("stability/critical_dt.csv") {
        let (name, nu, omega) = (row.text("network"), row.number("nu"), row.number("omega_max_rad_s"));
        let damping_time = nu / 15_000.0;
        for (integrator, column) in [
            (Integrator::ExplicitEuler, "dt_crit_explicit_euler_s"),
            (Integrator::SymplecticEuler, "dt_crit_symplectic_euler_s"),
            (Integrator::VelocityVerlet, "dt_crit_velocity_verlet_s"),
        ] {
            let expected = row.number(column);
            let found = critical_step_of_all(integrator, omega, damping_time).expect("a limit");
            if integrator == Integrator::VelocityVerlet && TOO_SHORT.contains(&(name, nu)) {
                let of = |i: u32| mode(omega * f64::from(i) / 10_000.0, damping_time);
                let radius = |i| of(i).spectral_radius(integrator, expected * 1.0005);
                assert!((1..=10_000).all(|i| radius(i) < 1.0), "{row:?}: a mode grows");
                continue;
            }
            assert!((found - expected).abs() <= 1e-8 * expected, "{row:?}, {integrator:?}: {found} s");
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
            let Some(critical) = critical_step(method.integrator, OMEGA, ratio) else {
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
