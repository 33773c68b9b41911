//! A cantilever under its own weight, eight cells thick: mean deflection and frequency.
#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use std::f64::consts::PI;

use nappe_sim::{
    collide::Contact,
    math::Precision,
    snow::{Kernel, Transfer},
};
use nappe_tests::{
    scene::advance,
    snow::{SnowScene, Variant, best_frequency, elastic, fit_wave, lattice, object, plane},
};

const H: f64 = 0.01;
const DENSITY: f64 = 1000.0;
const YOUNG: f64 = 1e6;
/// Cells: length and thickness.
const LENGTH: f64 = 80.0 * H;
const THICKNESS: f64 = 8.0 * H;

#[test]
fn a_cantilever_sags_and_swings_as_beam_theory_says() {
    // Without lateral contraction, so that an endless plate is a beam. Shear adds 0.8 (t/L)² = 0.8 %
    // to the deflection of a thin beam.
    let material = elastic(YOUNG, 0.0);
    let root = 4.0 * H;
    let low = [-root, -0.5 * THICKNESS, 0.0];
    let x = lattice(low, [168, 16, 4], [0.5 * H, 0.5 * H, H]);
    let body = object("beam", x, 0.25 * H.powi(3), DENSITY, material);
    let speed = (YOUNG / DENSITY).sqrt();
    let bending = THICKNESS * THICKNESS / 12.0;
    let gravity = 0.01 * LENGTH * 8.0 * YOUNG * bending / (DENSITY * LENGTH.powi(4));
    let deflection = DENSITY * gravity * LENGTH.powi(4) / (8.0 * YOUNG * bending);
    let omega = 1.875_104_f64.powi(2) / LENGTH.powi(2) * (YOUNG * bending / DENSITY).sqrt();

    let variant = Variant { kernel: Kernel::Quadratic, transfer: Transfer::Mls };
    let scene = SnowScene::new(vec![body], H, 0.8 * H / speed).by(variant).periodic([0, 0, 1]);
    let mut scene = scene.under([0.0, -gravity, 0.0]).grouped(20);
    scene.colliders = vec![plane([0.0; 3], [1.0, 0.0, 0.0], Contact::Sticky, 0.0)];
    let mut simulation = scene.simulate(Precision::F64);
    let tip = |simulation: &nappe_sim::world::Simulation| {
        let particles = simulation.snow_particles();
        let ends = particles.iter().zip(&scene.objects[0].x).filter(|(_, x)| x[0] > LENGTH - 0.5 * H);
        let moved: Vec<f64> = ends.map(|(p, x)| x[1] - p.x[1]).collect();
        moved.iter().sum::<f64>() / moved.len() as f64
    };

    let count = (2.0 * PI / omega / scene.dt).ceil() as u32;
    let mut samples = vec![[0.0, 0.0]];

    for step in 1..=count {
        advance(&mut simulation, 1);
        samples.push([f64::from(step) * scene.dt, tip(&simulation)]);
    }
    let found = best_frequency(&samples, omega);
    let [amplitude, mean, rest] = fit_wave(&samples, found);
    let [frequency, mean] = [found / omega - 1.0, mean / deflection - 1.0];
    println!(
        "cantilever: mean deflection {mean:+.2e}, frequency {frequency:+.2e}, amplitude {:.3}, rest {:.1e} of it",
        amplitude / deflection,
        rest / deflection
    );
    assert!(mean.abs() < 2e-2, "the mean deflection is off by {mean:e}");
    assert!(frequency.abs() < 2e-2, "the frequency is off by {frequency:e}");
}
