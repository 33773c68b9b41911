//! How much energy transfers dissipate at a long and at a short step, and what FLIP never damps.
#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use std::f64::consts::PI;

use nappe_sim::{
    math::Precision,
    snow::{Advection, Blend, GridNode, Kernel, Transfer},
    world::Simulation,
};
use nappe_tests::{
    networks::scatter,
    scene::advance,
    snow::{SnowScene, Variant, elastic, lattice, object, rework, step_once, wave_modulus},
};

const H: f64 = 0.1;
const DENSITY: f64 = 400.0;
/// Cells of the periodic line.
const CELLS: usize = 16;

/// Decay of the energy of a standing wave, -ln(E / E0), from one period to the next but one: mean
/// energies, since those of single steps swing.
fn decay(variant: Variant, courant: f64) -> f64 {
    let material = elastic(1.4e5, 0.0);
    let speed = (wave_modulus(&material) / DENSITY).sqrt();
    let x = lattice([0.0; 3], [2 * CELLS, 4, 4], [0.5 * H, H, H]);
    let body = object("line", x, 0.5 * H.powi(3), DENSITY, material);
    let k = 2.0 * PI / (CELLS as f64 * H);
    let period = 2.0 * PI / (speed * k);
    let steps = (period * speed / (courant * H)).round();
    let scene = SnowScene::new(vec![body], H, period / steps).by(variant).periodic([CELLS as u32 / 4, 1, 1]);
    let scene = scene.moving(|x| [1e-4 * speed * (k * x[0]).sin(), 0.0, 0.0]);
    let mut simulation = scene.simulate(Precision::F64);
    let mut mean =
        || (0..steps as u32).map(|_| step_once(&mut simulation).diagnostics.total_energy()).sum::<f64>();
    let [first, _, third] = [mean(), mean(), mean()];
    -(third / first).ln()
}

/// FLIP alone damps waves a little: F follows the grid's velocity, particles what they gather of
/// its change. That vanishes with dt and is taken off.
#[test]
fn blending_by_a_time_constant_damps_the_same_at_any_step_and_a_share_a_step_does_not() {
    for kernel in [Kernel::Quadratic, Kernel::Cubic] {
        let of = |blend, courant| decay(Variant { kernel, transfer: Transfer::PicFlip(blend) }, courant);
        // The same damping at the coarser step.
        let speed = (wave_modulus(&elastic(1.4e5, 0.0)) / DENSITY).sqrt();
        let tau = -(0.4 * H / speed) / 0.95_f64.ln();
        let courants = [0.4, 0.2, 0.1];
        let flip = courants.map(|courant| of(Blend::PerStep(1.0), courant));
        let [constant, share] = [Blend::TimeConstant(tau), Blend::PerStep(0.95)]
            .map(|blend| [0, 1, 2].map(|i| of(blend, courants[i]) - flip[i]));
        println!(
            "{}: decay at dt, dt/2, dt/4: time constant {constant:.4?}, a share {share:.4?}, FLIP alone {flip:.4?}",
            kernel.name()
        );

        for i in 0..2 {
            let ratio = constant[i + 1] / constant[i];
            assert!((ratio - 1.0).abs() < 0.05, "{}: a time constant: {ratio}", kernel.name());
            let ratio = share[i + 1] / share[i];
            assert!((1.9..2.1).contains(&ratio), "{}: a share a step: {ratio}", kernel.name());
            assert!(flip[i + 1] < 0.6 * flip[i], "{}: FLIP alone {flip:?}", kernel.name());
        }
    }
}

/// Kinetic energy of the particles, and the part of it that the grid sees.
fn energies(simulation: &Simulation, masses: &[f64]) -> [f64; 2] {
    let square = |v: &[f64; 3]| v.iter().map(|c| c * c).sum::<f64>();
    let mut nodes: Vec<GridNode> = Vec::new();
    simulation.grid_nodes(&mut nodes);
    let grid = nodes.iter().map(|n| 0.5 * n.mass * square(&n.velocity)).sum();
    let particles = simulation.snow_particles();
    [particles.iter().zip(masses).map(|(p, m)| 0.5 * m * square(&p.v)).sum(), grid]
}

/// Seven of eight velocities of a full cell are invisible to the grid. FLIP keeps them for ever.
#[test]
fn flip_keeps_what_the_grid_does_not_see_and_affine_transfers_drop_it() {
    let material = elastic(1.4e5, 0.2);
    let speed = (wave_modulus(&material) / DENSITY).sqrt();
    let flip = |share| Transfer::PicFlip(Blend::PerStep(share));

    for transfer in [flip(1.0), flip(0.95), flip(0.0), Transfer::Apic, Transfer::Mls] {
        let variant = Variant { kernel: Kernel::Quadratic, transfer };
        let x = lattice([0.0; 3], [8; 3], [0.5 * H; 3]);
        let body = object("full", x, (0.5 * H).powi(3), DENSITY, material);
        let mut scene = SnowScene::new(vec![body], H, 0.3 * H / speed).by(variant).periodic([1; 3]);

        // Else particles wander, each with the velocity that the grid does not see.
        scene.settings.advection = Advection::Grid;
        let mut simulation = scene.simulate(Precision::F64);
        rework(&mut simulation, |i, p| p.v = [0, 1, 2].map(|a| 1e-3 * scatter(3 * i + a)));
        let masses = scene.masses();
        let start = energies(&simulation, &masses)[0];
        let mut shares = Vec::new();

        for steps in [1, 9, 90, 900] {
            advance(&mut simulation, steps);
            let [all, seen] = energies(&simulation, &masses);
            shares.push((all - seen) / start);
        }

        println!("{transfer:?}: unseen energy after 1, 10, 100, 1000 steps: {shares:.4?}");
        if transfer == flip(1.0) {
            assert!(shares[3] > 0.3, "FLIP keeps what it cannot see: {shares:?}");
        } else {
            assert!(shares[3] < 0.02, "{transfer:?} drops what it cannot see: {shares:?}");
        }
    }
}
