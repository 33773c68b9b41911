//! Pendulums of links that hardly stretch: the period of one at large angles, and the modes of a hanging chain.
//!
//! A spring of stiffness k changes both by a share that goes with 1/k; two stiffnesses give what it is without.

use nappe_sim::{cloth::Integrator, math::Precision};
use nappe_tests::{
    Scene,
    networks::chain,
    scene::{advance, positions},
};

const GRAVITY: f64 = 9.81;
const LENGTH: f64 = 0.7;
const MASS: f64 = 0.3;
/// Stiffnesses over m g / l.
const STIFF: [f64; 2] = [2000.0, 4000.0];

/// From values at the two stiffnesses to that of links without stretch.
fn without_stretch(of: impl Fn(f64) -> f64) -> f64 {
    let [soft, hard] = STIFF.map(of);
    2.0 * hard - soft
}

/// A bob at rest at an angle (rad) from the vertical, with the stretch that holds it there along the link.
fn pendulum(integrator: Integrator, angle: f64, stiffness: f64) -> Scene {
    let k = stiffness * MASS * GRAVITY / LENGTH;
    let length = LENGTH + MASS * GRAVITY * angle.cos() / k;
    let bob = [length * angle.sin(), -length * angle.cos(), 0.0];
    let mut network = chain(&[[0.0; 3], bob], LENGTH, k, 0.0, MASS);
    network.pins = vec![0];
    let dt = 0.1 * (MASS / k).sqrt();
    let mut scene = Scene::new(network, dt).under([0.0, -GRAVITY, 0.0]);
    scene.settings.integrator = integrator;
    scene
}

/// The mean of some periods (s), each from one way through the vertical to the next in the same direction.
fn period(integrator: Integrator, angle: f64, stiffness: f64) -> f64 {
    const PERIODS: usize = 2;
    let scene = pendulum(integrator, angle, stiffness);
    let mut simulation = scene.simulate(Precision::F64);
    let (mut passed, mut before, mut step) = (Vec::new(), positions(&simulation)[1][0], 0.0);
    while passed.len() <= PERIODS {
        advance(&mut simulation, 1);
        step += 1.0;
        let now = positions(&simulation)[1][0];
        if before > 0.0 && now <= 0.0 {
            passed.push((step - now / (now - before)) * scene.dt);
        }
        before = now;
    }
    (passed[PERIODS] - passed[0]) / PERIODS as f64
}

#[test]
fn a_pendulum_has_its_period_at_large_angles() {
    // 2 K(sin²(angle / 2)) / pi, with the complete elliptic integral K.
    let ratios = [(45.0_f64, 1.039_973_3), (90.0, 1.180_340_6), (150.0, 1.762_203_7)];
    let small = std::f64::consts::TAU * (LENGTH / GRAVITY).sqrt();
    for integrator in [Integrator::SymplecticEuler, Integrator::VelocityVerlet] {
        for (degrees, expected) in ratios {
            let found = without_stretch(|k| period(integrator, degrees.to_radians(), k)) / small;
            let error = (found / expected - 1.0).abs();
            assert!(error < 1e-5, "{} at {degrees} degrees: {found}, not {expected}", integrator.name());
        }
    }
}

#[test]
fn velocity_verlet_keeps_the_energy_of_a_pendulum_over_a_hundred_periods() {
    let scene = pendulum(Integrator::VelocityVerlet, 1.5, STIFF[0]);
    let mut simulation = scene.simulate(Precision::F64);
    let swing = MASS * GRAVITY * LENGTH;
    let small = std::f64::consts::TAU * (LENGTH / GRAVITY).sqrt();
    let part = (1.18 * small / scene.dt) as u64;
    let first = advance(&mut simulation, 1).diagnostics.total_energy();
    for period in 1..=100 {
        let drift = (advance(&mut simulation, part).diagnostics.total_energy() - first) / swing;
        assert!(drift.abs() < 1e-4, "after {period} periods: {drift:e}");
    }
}

/// The Laguerre polynomials of degrees 0 to `count` - 1 at x: how far the beads of a hanging chain are from the vertical in
/// a mode, the lowest first.
fn shape(count: usize, x: f64) -> Vec<f64> {
    let mut values = vec![1.0, 1.0 - x];
    for j in 1..count {
        let n = j as f64;
        values.push(((2.0 * n + 1.0 - x) * values[j] - n * values[j - 1]) / (n + 1.0));
    }
    values.truncate(count);
    values
}

/// The frequency of a mode over sqrt(g / l), by the accelerations of the chain that hangs at rest and is displaced in the
/// mode: leapfrog makes the second difference of its amplitude that acceleration times dt².
fn frequency(count: usize, guess: f64, stiffness: f64) -> f64 {
    let k = stiffness * count as f64 * MASS * GRAVITY / LENGTH;
    let mut height = 0.0;
    let mut x = vec![[0.0; 3]];
    for below in (1..=count).rev() {
        height -= LENGTH + below as f64 * MASS * GRAVITY / k;
        x.push([0.0, height, 0.0]);
    }
    let mode: Vec<f64> = std::iter::once(0.0).chain(shape(count, guess * guess).into_iter().rev()).collect();
    for (x, along) in x.iter_mut().zip(&mode) {
        x[2] = 1e-5 * LENGTH * along;
    }

    let mut network = chain(&x, LENGTH, k, 0.0, MASS);
    network.pins = vec![0];
    let dt = 0.1 * (MASS / k).sqrt();
    let mut scene = Scene::new(network, dt).under([0.0, -GRAVITY, 0.0]);
    scene.settings.integrator = Integrator::VelocityVerlet;
    let mut simulation = scene.simulate(Precision::F64);
    let mut amplitudes = [0.0; 3];
    for amplitude in &mut amplitudes {
        *amplitude = positions(&simulation).iter().zip(&mode).map(|(x, along)| x[2] * along).sum();
        advance(&mut simulation, 1);
    }
    let [first, second, third] = amplitudes;
    let squared = (2.0 * second - first - third) / (dt * dt * second);
    (squared * LENGTH / GRAVITY).sqrt()
}

#[test]
fn a_hanging_chain_has_its_modes() {
    // Roots of the Laguerre polynomials: their square roots.
    let modes: [(usize, &[f64]); 3] = [
        (2, &[0.765_367, 1.847_759]),
        (5, &[0.513_381, 1.188_866, 1.896_425]),
        (10, &[0.371_205, 0.854_081, 1.344_746]),
    ];
    for (count, frequencies) in modes {
        for expected in frequencies {
            let found = without_stretch(|k| frequency(count, *expected, k));
            let error = (found / expected - 1.0).abs();
            assert!(error < 1e-5, "{count} beads: {found}, not {expected}");
        }
    }
}
