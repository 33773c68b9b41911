//! The largest stable step, measured: a particle alone against its closed form, full blocks against
//! their von Neumann limit, and the bounds that the program certifies.
#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use nappe_sim::{
    math::Precision,
    snow::{Kernel, Material, Transfer},
    time_step::TimeStep,
    world::Simulation,
};
use nappe_study::longest_step;
use nappe_tests::{
    networks::scatter,
    scene::try_advance,
    snow::{SnowScene, Variant, elastic, lattice, object, rework, wave_modulus},
};

const H: f64 = 0.1;
const DENSITY: f64 = 400.0;
const MATERIAL: Material = elastic(1.4e5, 0.2);
/// Strain at the start.
const NUDGE: f64 = 1e-8;

/// h sqrt(rho / (2 mu + 3 lambda)) (s): the limit of a particle alone with MLS and the quadratic kernel.
fn lone_limit() -> f64 {
    H * (DENSITY / (2.0 * MATERIAL.mu() + 3.0 * MATERIAL.lambda())).sqrt()
}

/// Largest difference of F from the identity.
fn strain(simulation: &Simulation) -> f64 {
    let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let of = |f: &[[f64; 3]; 3]| {
        f.as_flattened().iter().zip(identity).map(|(f, i)| (f - i).abs()).fold(0.0, f64::max)
    };
    simulation.snow_particles().iter().map(|p| of(&p.elastic)).fold(0.0, f64::max)
}

/// Growth of a small strain in `steps` steps; infinite when the run fails.
fn growth(scene: &SnowScene, steps: u32) -> f64 {
    let mut simulation = scene.clone().grouped(steps).simulate(Precision::F64);
    rework(&mut simulation, |i, p| {
        for k in 0..9 {
            p.elastic[k / 3][k % 3] += NUDGE * scatter(9 * i + k);
        }
        // All directions at once: the stiffest way to press a particle.
        (0..3).for_each(|a| p.elastic[a][a] += NUDGE);
    });
    try_advance(&mut simulation, 1).map_or(f64::INFINITY, |_| strain(&simulation) / NUDGE)
}

/// A particle alone at an offset (cells) from a node.
fn alone(variant: Variant, offset: [f64; 3], dt: f64) -> SnowScene {
    let body = object("alone", vec![offset.map(|o| o * H)], (0.5 * H).powi(3), DENSITY, MATERIAL);
    let mut scene = SnowScene::new(vec![body], H, dt).by(variant);
    scene.settings.max_substeps = 1_000_000;
    scene
}

#[test]
fn a_particle_alone_is_stable_below_its_closed_form_and_not_above() {
    for (kernel, factor) in [(Kernel::Quadratic, 1.0), (Kernel::Cubic, 2.0 / 3.0_f64.sqrt())] {
        let variant = Variant { kernel, transfer: Transfer::Mls };
        for offset in [[0.0; 3], [0.31, 0.05, 0.44], [0.5, 0.25, 0.77]] {
            let [below, above] = [0.9, 1.1].map(|share| {
                let steps = if share < 1.0 { 10_000 } else { 400 };
                growth(&alone(variant, offset, share * factor * lone_limit()), steps)
            });
            assert!(below < 20.0, "{} at {offset:?}: grows {below:e} below the limit", variant.name());
            assert!(above > 1e6, "{} at {offset:?}: grows {above:e} above the limit", variant.name());
            let found = limit(|dt| alone(variant, offset, dt), lone_limit(), [0.5, 2.0], 1000);
            assert!(
                (found / factor - 1.0).abs() < 2e-2,
                "{} at {offset:?}: {found}, not {factor}",
                variant.name()
            );
        }
    }
}

/// The largest stable step of `scene`, in units of `unit` (s), between two shares of it: as the study of stability finds it.
fn limit(scene: impl Fn(f64) -> SnowScene, unit: f64, range: [f64; 2], steps: u32) -> f64 {
    let start = f64::midpoint(range[0], range[1]) * unit;
    longest_step(start, range.map(|share| share * unit), |dt| growth(&scene(dt), steps) < 1e3) / unit
}

/// Offsets along an axis that between them come near every weight a particle can have.
const OFFSETS: [f64; 5] = [0.0, 0.13, 0.27, 0.41, 0.5];

#[test]
fn forces_by_slopes_are_stable_up_to_the_certified_share_wherever_a_particle_is() {
    for variant in Variant::all().into_iter().filter(|v| v.kernel != Kernel::Linear) {
        if variant.transfer == Transfer::Mls {
            continue;
        }
        let certified = certified_share(variant);
        let mut least = f64::INFINITY;

        for (i, x) in OFFSETS.into_iter().enumerate() {
            for (j, y) in OFFSETS[..=i].iter().enumerate() {
                for z in &OFFSETS[..=j] {
                    let scene = |dt| alone(variant, [x, *y, *z], dt);
                    let below = growth(&scene(0.95 * certified * lone_limit()), 600);
                    let place = format!("{} at {:?}", variant.name(), [x, *y, *z]);
                    assert!(below < 1e3, "{place}: grows {below:e} below the certified step");
                    let is_worse = |least: f64| growth(&scene(0.99 * least * lone_limit()), 600) > 1e3;
                    if least.is_infinite() || is_worse(least) {
                        least = least.min(limit(scene, lone_limit(), [0.9 * certified, 3.0], 600));
                    }
                }
            }
        }

        println!(
            "{}: a particle alone is stable up to {least:.3} of its unit, certified {certified:.3}",
            variant.name()
        );
        assert!(least < 1.35 * certified, "{}: {certified} is far from {least}", variant.name());
    }
}

/// What the program certifies for a particle alone, in units of h sqrt(rho / (2 mu + 3 lambda)).
fn certified_share(variant: Variant) -> f64 {
    let mut scene = alone(variant, [0.2, 0.3, 0.4], 1e-9);
    scene.settings.time_step = TimeStep::Certified { safety: 1.0 };
    let mut simulation = scene.simulate(Precision::F64);
    let report = try_advance(&mut simulation, 1).expect("a step").snow.expect("a report of the snow");
    report.bound.dt / lone_limit()
}

/// Full blocks, eight particles a cell, periodic, nudged at random.
fn full(variant: Variant, dt: f64) -> SnowScene {
    let x = lattice([0.0; 3], [8; 3], [0.5 * H; 3]);
    let body = object("full", x, (0.5 * H).powi(3), DENSITY, MATERIAL);
    SnowScene::new(vec![body], H, dt).by(variant).periodic([1; 3])
}

#[test]
fn full_blocks_are_stable_up_to_their_von_neumann_limit() {
    let unit = H / (wave_modulus(&MATERIAL) / DENSITY).sqrt();
    for (kernel, known) in [(Kernel::Quadratic, 1.306), (Kernel::Cubic, 1.739)] {
        let variant = Variant { kernel, transfer: Transfer::Mls };
        let found = limit(|dt| full(variant, dt), unit, [0.8 * known, 1.25 * known], 300);
        println!(
            "{}: full blocks are stable up to c dt / h = {found:.3}, von Neumann {known}",
            variant.name()
        );
        assert!((found / known - 1.0).abs() < 2e-2, "{}: {found}, not {known}", variant.name());
    }
}

#[test]
fn full_blocks_of_every_transfer_are_stable_at_the_certified_step() {
    for variant in Variant::all() {
        let mut scene = full(variant, 1e-9);
        // Without the bound of particles alone.
        scene.settings.ballistic_below = 1e-9;
        scene.settings.time_step = TimeStep::Certified { safety: 1.0 };
        let mut simulation = scene.simulate(Precision::F64);
        let report = try_advance(&mut simulation, 1).expect("a step").snow.expect("a report of the snow");
        let below = growth(&full(variant, 0.98 * report.bound.dt), 1000);
        let unit = H / (wave_modulus(&MATERIAL) / DENSITY).sqrt();
        let certified = report.bound.dt / unit;
        let found = limit(|dt| full(variant, dt), unit, [0.9 * certified, 2.5], 300);
        println!("{}: full blocks certified up to {certified:.3}, stable up to {found:.3}", variant.name());
        assert!(below < 1e3, "{}: grows {below:e} below the certified step", variant.name());
    }
}
