//! The bound on dt that the program computes for any mesh, against exact eigenvalues.

use nappe_sim::{cloth::Network, math::Precision};
use nappe_study::largest_frequency;
use nappe_tests::{
    Scene,
    golden::{Transient, document, table},
    networks::{DrapSprings, chain, drap, particles, sheet, sheet_rules},
};
use serde::Deserialize;

#[derive(Deserialize)]
struct Frequencies {
    networks: Vec<Frequency>,
}

#[derive(Deserialize)]
struct Frequency {
    network: String,
    n_particles: usize,
    n_springs: usize,
    omega_max_rest: f64,
    dt_crit_undamped: f64,
}

/// The networks of the golden tables.
pub(crate) fn network(name: &str, damping: f64) -> Network {
    match name {
        "drap10/faces" => drap(10, DrapSprings::Faces, damping),
        "drap10/full" => drap(10, DrapSprings::Full, damping),
        "drap70/faces" => drap(70, DrapSprings::Faces, damping),
        "drap70/full" => drap(70, DrapSprings::Full, damping),
        "cloth10" => Transient::named("cloth10 nu=0").network.network(),
        "chain20" => Transient::named("chain20 nu=0").network.network(),
        other => panic!("no network on record is named {other}"),
    }
}

#[test]
fn the_course_cloth_by_formula_is_the_one_on_record() {
    let golden = Transient::named("drap10 nu=0.01").network.network();
    let ours = drap(10, DrapSprings::Faces, 0.01);
    assert_eq!(ours.x, golden.x);
    let pairs = |network: &Network| {
        let mut pairs: Vec<_> =
            network.springs.iter().map(|s| (s.particles, s.rest_length.to_bits())).collect();
        pairs.sort_unstable();
        pairs
    };

    let (ours, golden) = (pairs(&ours), pairs(&golden));
    assert_eq!(ours.len(), golden.len());
    for (ours, golden) in ours.iter().zip(&golden) {
        assert_eq!(ours.0, golden.0);
        let [a, b] = [ours.1, golden.1].map(f64::from_bits);
        assert!((a - b).abs() <= f64::EPSILON * b, "{:?}: {a} m, not {b}", ours.0);
    }
}

#[test]
fn the_fastest_mode_is_found_without_a_stored_matrix() {
    for row in document::<Frequencies>("stability/omega_max.json").networks {
        let found = largest_frequency(&network(&row.network, 0.0));
        let error = (found / row.omega_max_rest - 1.0).abs();
        assert!(error < 1e-6, "{}: {found} rad/s is off by {error:e}", row.network);
    }
    let mut pinned = chain(&[[0.0; 3], [1.0, 0.0, 0.0]], 1.0, 50.0, 0.0, 2.0);
    pinned.pins = vec![0];
    assert!((largest_frequency(&pinned) - 5.0).abs() < 1e-12);
    pinned.pins = vec![0, 1];
    assert_eq!(largest_frequency(&pinned), 0.0);
}

#[test]
fn the_step_bound_is_below_the_largest_stable_step_and_near_it() {
    for row in document::<Frequencies>("stability/omega_max.json").networks {
        let network = network(&row.network, 0.0);
        assert_eq!(
            (network.x.len(), network.springs.len()),
            (row.n_particles, row.n_springs),
            "{}",
            row.network
        );
        for precision in Precision::ALL {
            let bound = &Scene::new(network.clone(), 1e-3).simulate(precision).step_bounds()[0];
            let share = bound.dt / row.dt_crit_undamped;
            assert!(
                share <= 1.0 + 1e-6,
                "{}: {} s is {share} of the largest stable step",
                row.network,
                bound.dt
            );
            // Measured on these networks: 0.77 to 1.
            assert!(
                share > 0.75,
                "{}: {} s is only {share} of the largest stable step",
                row.network,
                bound.dt
            );
        }
    }
}

#[test]
fn damping_lowers_the_step_bound_as_it_lowers_the_largest_stable_step() {
    for row in table("stability/critical_dt.csv") {
        let network = network(row.text("network"), row.number("nu"));
        let bound = &Scene::new(network, 1e-3).simulate(Precision::F64).step_bounds()[0];
        let share = bound.dt / row.number("dt_crit_symplectic_euler_s");
        assert!(share <= 1.0 + 1e-6, "{row:?}: {} s is {share} of the largest stable step", bound.dt);
        // Measured on these networks: 0.73 to 0.87.
        assert!(share > 0.7, "{row:?}: {} s is only {share} of the largest stable step", bound.dt);
        assert!(bound.dt <= row.number("dt_crit_velocity_verlet_s"), "{row:?}: {} s", bound.dt);
    }
}

#[test]
fn drag_lowers_the_step_bound_to_where_a_step_turns_velocities_around() {
    // v' = v (1 - h drag / m) grows from h = 2 m / drag on.
    let mut network = particles(&[[0.0; 3], [1.0, 0.0, 0.0]], 0.02);
    let bound =
        |network: &Network| Scene::new(network.clone(), 1e-3).simulate(Precision::F64).step_bounds()[0].dt;
    assert_eq!(bound(&network), f64::INFINITY);
    network.drag = 0.5;
    assert!((bound(&network) - 2.0 * 0.02 / 0.5).abs() < 1e-16, "{} s", bound(&network));
}

#[test]
fn the_step_bound_of_a_sheet_is_that_of_the_infinite_grid() {
    // 24 x 24 particles, springs along rows and columns alone: the bound is the largest stable step
    // of the infinite grid, omega² = 4 k / m.
    let mut rules = sheet_rules(100.0, 0.0);
    (rules.shear, rules.bend) = (None, None);
    let bound = &Scene::new(sheet(24, 0.1, &rules, 0.01), 1e-3).simulate(Precision::F64).step_bounds()[0];
    let infinite = 2.0 / (4.0 * 100.0 / 0.01_f64).sqrt();
    assert!((bound.dt / infinite - 1.0).abs() < 1e-12, "{} s, not {infinite}", bound.dt);
}

#[test]
fn the_step_bound_names_the_particle_that_sets_it() {
    let x: Vec<_> = (0..40).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect();
    let mut network = chain(&x, 0.1, 50.0, 0.0, 1.0);
    network.masses[23] = 0.25;
    let bound = &Scene::new(network.clone(), 1e-3).simulate(Precision::F64).step_bounds()[0];
    assert_eq!(bound.particle, 23);
    let expected = (2.0 * 0.25 / (2.0 * 50.0_f64)).sqrt();
    assert!((bound.dt - expected).abs() < 1e-15, "{} s, not {expected}", bound.dt);

    // Pinned, it sets nothing.
    network.pins = vec![23];
    let bound = &Scene::new(network, 1e-3).simulate(Precision::F64).step_bounds()[0];
    assert_ne!(bound.particle, 23);
}
