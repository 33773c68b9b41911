//! The implicit midpoint by one linear solve, of cloth under compression: its order and its energy do not depend on what the
//! matrix makes of compressed springs.

use nappe_sim::{
    cloth::{Hessian, Integrator, Network},
    math::Precision,
    world::Change,
};
use nappe_tests::{
    Method, Scene,
    networks::{chain, scatter, sheet, sheet_rules, spring},
    scene::{advance, difference, norm, positions},
};

/// How long the pin moves (s).
const DURATION: f64 = 0.4;

/// Five particles between two pins in line, with springs that bend.
fn pressed() -> Network {
    let x: Vec<_> = (0..5).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect();
    let mut network = chain(&x, 0.1, 40.0, 0.0, 0.05);
    network.springs.extend((0..3).map(|i| spring([i, i + 2], 0.2, 4.0, 0.0)));
    network.pins = vec![0, 4];
    network
}

/// Where they are when one pin has come nearer by 12 cm, in so many steps: its springs are down to 0.74 of their length.
fn pressed_together(method: Method, steps: u64) -> Vec<[f64; 3]> {
    let scene = Scene::new(pressed(), DURATION / steps as f64).by(method).under([0.0, -9.81, 0.0]);
    let mut simulation = scene.simulate(Precision::F64);
    let change = Change::Pin { particle: 4, target: [0.28, 0.0, 0.0], duration: DURATION };
    simulation.apply(&[change]).expect("a pin may move");
    advance(&mut simulation, steps);
    positions(&simulation)
}

/// Root of the mean square over the free particles (m).
fn distance(found: &[[f64; 3]], expected: &[[f64; 3]]) -> f64 {
    let squares = (1..4).map(|i| norm(difference(found[i], expected[i])).powi(2));
    (squares.sum::<f64>() / 3.0).sqrt()
}

#[test]
fn the_implicit_midpoint_has_order_2_under_compression_whatever_the_hessian() {
    // By a method of another kind, its own error of order 2 taken off: what is left is far below 1e-9 m.
    let fine = Method::new(Integrator::VelocityVerletPredicted, Hessian::Absolute);
    let [coarse, fine] = [6400, 12_800].map(|steps| pressed_together(fine, steps));
    let extrapolated = |i: usize| [0, 1, 2].map(|c| (4.0 * fine[i][c] - coarse[i][c]) / 3.0);
    let reference: Vec<_> = (0..5).map(extrapolated).collect();
    for integrator in [Integrator::ImplicitMidpoint, Integrator::Bdf2] {
        for hessian in Hessian::ALL {
            let method = Method::new(integrator, hessian);
            let error = |steps: u64| distance(&pressed_together(method, steps), &reference);
            // BDF2 starts with a step of order 1, and comes to its slope later.
            let steps = if integrator == Integrator::Bdf2 { 640 } else { 320 };
            let order = (error(steps) / error(2 * steps)).log2();
            assert!((order - 2.0).abs() < 0.05, "{}: order {order:.3}", method.name());
        }
    }
    // The error itself, as an independent program found it.
    let method = Method::new(Integrator::ImplicitMidpoint, Hessian::Absolute);
    let error = distance(&pressed_together(method, 160), &reference);
    assert!((error / 9.972e-5 - 1.0).abs() < 0.01, "{error:e} m");
}

#[test]
fn the_implicit_midpoint_keeps_the_energy_of_an_undamped_free_cloth() {
    let mut network = sheet(5, 0.1, &sheet_rules(100.0, 0.0), 0.01);
    network.pins.clear();
    for i in 0..network.x.len() {
        for c in 0..3 {
            network.x[i][c] += 0.01 * scatter(3 * i + c);
            network.v[i][c] = 0.3 * scatter(1000 + 3 * i + c);
        }
    }
    for hessian in Hessian::ALL {
        let method = Method::new(Integrator::ImplicitMidpoint, hessian);
        let mut simulation = Scene::new(network.clone(), 1e-3).by(method).simulate(Precision::F64);
        let start = simulation.diagnose().total_energy();
        for step in 0..1000 {
            let energy = advance(&mut simulation, 1).diagnostics.total_energy();
            // An independent program finds 0.1 %; |g| on both sides took 36 %.
            assert!((energy / start - 1.0).abs() < 0.01, "{}, step {step}: {energy} J", method.name());
        }
    }
}
