//! Static equilibria reached by stepping, against force balances in 45 digits.

use nappe_sim::{cloth::Network, linalg::Stop};
use nappe_tests::{
    Scene,
    golden::{Transient, document, table},
    networks::{chain, scatter},
    scene::{difference, max_distance, norm},
    statics::equilibrium,
};
use serde::Deserialize;

const GRAVITY: f64 = 9.81;

#[derive(Deserialize)]
struct Chains {
    cases: Vec<Hung>,
}

#[derive(Deserialize)]
struct Hung {
    case: String,
    #[serde(rename = "N_springs")]
    count: usize,
    k: f64,
    m: f64,
    l0: f64,
    g: f64,
    end: [f64; 3],
    x_equilibrium: Vec<[f64; 3]>,
    #[serde(rename = "spring_tension_N")]
    tension: Vec<f64>,
}

/// A chain of `count` springs between the origin and `end`, both pinned, started on a parabola of
/// about its length.
fn hung_chain(count: usize, end: [f64; 3], rest_length: f64, stiffness: f64, mass: f64) -> Network {
    let (span, length) = (norm(end), rest_length * count as f64);
    let sag = (0.375 * span * (length - span)).max(0.0).sqrt() + 0.02 * span;
    let at = |i: usize| {
        let s = i as f64 / count as f64;
        [end[0] * s, end[1] * s - 4.0 * sag * s * (1.0 - s), end[2] * s]
    };
    let mut x: Vec<_> = (0..=count).map(at).collect();
    x[count] = end;
    let mut network = chain(&x, rest_length, stiffness, 0.0, mass);
    network.pins = vec![0, count as u32];
    network
}

#[test]
fn a_hung_chain_rests_where_its_forces_balance() {
    for case in document::<Chains>("spring_mass/chain20_static.json").cases {
        let network = hung_chain(case.count, case.end, case.l0, case.k, case.m);
        let scene = Scene::new(network, 0.1).under([0.0, -case.g, 0.0]);
        let x = equilibrium(&scene, 0.3, 150);
        let error = max_distance(&x, &case.x_equilibrium);
        assert!(error < 1e-10, "{}: {error:e} m", case.case);
        for (i, expected) in case.tension.iter().enumerate() {
            let tension = case.k * (norm(difference(x[i + 1], x[i])) - case.l0);
            assert!((tension - expected).abs() < 1e-8, "{}, spring {i}: {tension} N", case.case);
        }
    }
}

#[test]
fn an_elastic_catenary_of_springs_has_its_sag_and_tension() {
    for row in table("elastica/catenary_springs.csv") {
        // Weight 1 N in all.
        let count = row.count("N_springs") as usize;
        let [span, length] = [row.number("D_m"), row.number("L0_m")];
        let rest_length = length / count as f64;
        let stiffness = row.number("EA_over_W") / rest_length;
        let mass = 1.0 / (count as f64 * GRAVITY);
        let network = hung_chain(count, [span, 0.0, 0.0], rest_length, stiffness, mass);
        let mut scene = Scene::new(network, 0.1).under([0.0, -GRAVITY, 0.0]);
        scene.settings.solver.stop = Stop::Residual { tolerance: 1e-13, max_iterations: 4000 };
        let x = equilibrium(&scene, 0.3, 60);
        let sag = x.iter().map(|x| -x[1]).fold(0.0, f64::max);
        let error = (sag - row.number("sag_of_lowest_node_m")).abs();
        assert!(error < 1e-9, "{row:?}: sag {sag} m, off by {error:e}");
        let d = difference(x[1], x[0]);
        let pull = stiffness * (norm(d) - rest_length) * d[0] / norm(d);
        let error = (pull - row.number("H_over_W")).abs();
        assert!(error < 1e-8, "{row:?}: horizontal tension {pull} N, off by {error:e}");
    }
}

#[test]
fn each_spring_of_a_chain_that_hangs_carries_what_hangs_below() {
    let (count, stiffness, mass, rest_length) = (12_usize, 80.0, 0.05, 0.1);
    let x: Vec<_> = (0..=count).map(|i| [0.0, -rest_length * i as f64, 0.0]).collect();
    let mut network = chain(&x, rest_length, stiffness, 0.0, mass);
    network.pins = vec![0];
    let x = equilibrium(&Scene::new(network, 0.1).under([0.0, -GRAVITY, 0.0]), 0.3, 150);
    for j in 1..=count {
        let elongation = norm(difference(x[j], x[j - 1])) - rest_length;
        let expected = (count - j + 1) as f64 * mass * GRAVITY / stiffness;
        assert!((elongation - expected).abs() < 1e-10, "spring {j}: {elongation} m, not {expected}");
    }

    let sum = mass * GRAVITY * (count * (count + 1)) as f64 / (2.0 * stiffness);
    let total = -x[count][1] - rest_length * count as f64;
    assert!((total - sum).abs() < 1e-10, "in all {total} m, not {sum}");
}

#[derive(Deserialize)]
struct Equilibria {
    rows: Vec<Rest>,
}

#[derive(Deserialize)]
struct Rest {
    network: String,
    x_equilibrium: Option<Vec<[f64; 3]>>,
}

#[test]
fn a_hung_cloth_rests_where_its_forces_balance() {
    let rows = document::<Equilibria>("stability/omega_at_equilibrium.json").rows;
    let rest = rows.into_iter().find(|row| row.network == "cloth10").expect("the cloth is on record");
    let expected = rest.x_equilibrium.expect("its positions are on record");
    let motion = Transient::named("cloth10 nu=0.1");
    let mut network = motion.network.network();

    // Folded cloth has several equilibria: this one is left by 10 µm and must be found again.
    for i in 0..network.x.len() {
        let moves = if network.pins.contains(&(i as u32)) { 0.0 } else { 1e-5 };
        network.x[i] = [0, 1, 2].map(|c| expected[i][c] + moves * scatter(3 * i + c));
    }

    let scene = Scene::new(network, 0.1).under(motion.network.gravity_m_s2);
    let error = max_distance(&equilibrium(&scene, 0.3, 0), &expected);
    assert!(error < 1e-10, "{error:e} m");
}
