//! Whole steps of Stomakhin et al. 2013 on 27 particles, after 1, 2, 10 and 40 of them.

use nappe_sim::{
    math::Precision,
    snow::{Blend, Kernel, SnowObject, Transfer},
    world::Simulation,
};
use nappe_tests::{
    golden,
    scene::{advance, max_distance},
    snow::{SnowScene, Variant},
};
use serde::Deserialize;

use crate::reference::{free_snow, matrix, relative};

#[derive(Deserialize)]
#[allow(non_snake_case, reason = "the names of the document")]
struct State {
    step: u64,
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    FE: Vec<[[f64; 3]; 3]>,
    FP: Vec<[[f64; 3]; 3]>,
    grid_mass: f64,
    grid_momentum_after_forces: [f64; 3],
    n_particles_plastic: usize,
}

#[derive(Deserialize)]
#[allow(non_snake_case, reason = "the names of the document")]
struct Golden {
    dx: f64,
    dt: f64,
    g: [f64; 3],
    alpha: f64,
    mass: f64,
    x0: Vec<[f64; 3]>,
    v0: Vec<[f64; 3]>,
    V0: Vec<f64>,
    states: Vec<State>,
}

/// The scene of the document; volumes from the grid, unless they are given.
fn scene(golden: &Golden, volume: Vec<f64>) -> SnowScene {
    let object = SnowObject {
        name: "snow".to_owned(),
        x: golden.x0.clone(),
        v: golden.v0.clone(),
        angular_velocity: [0.0; 3],
        mass: vec![golden.mass; golden.x0.len()],
        volume,
        stiffness: Vec::new(),
        material: nappe_sim::snow::Material {
            // Within what a world allows; J_P stays far from its ends.
            plasticity: free_snow()
                .plasticity
                .map(|p| nappe_sim::snow::Plasticity { plastic_ratio_range: [0.1, 20.0], ..p }),
            ..free_snow()
        },
        attach: None,
    };

    let transfer = Transfer::PicFlip(Blend::PerStep(golden.alpha));
    SnowScene::new(vec![object], golden.dx, golden.dt)
        .by(Variant { kernel: Kernel::Cubic, transfer })
        .under(golden.g)
}

fn compare(simulation: &Simulation, state: &State) {
    let (step, particles) = (state.step, simulation.snow_particles());
    let x: Vec<_> = particles.iter().map(|p| p.x).collect();
    let v: Vec<_> = particles.iter().map(|p| p.v).collect();
    let off = max_distance(&x, &state.x);
    assert!(off < 1e-11, "step {step}: positions are off by {off:e} m");
    let off = max_distance(&v, &state.v);
    assert!(off < 1e-11, "step {step}: velocities are off by {off:e} m/s");
    let mut plastic = 0;

    for (i, p) in particles.iter().enumerate() {
        let off = relative(&matrix(&p.elastic), &matrix(&state.FE[i]), 0.0);
        assert!(off < 1e-11, "step {step}, particle {i}: F_E is off by {off:e}");
        let jp = matrix(&state.FP[i]).determinant();
        let off = (p.plastic_ratio - jp).abs();
        assert!(off < 1e-11, "step {step}, particle {i}: J_P = {}, not {jp}", p.plastic_ratio);
        plastic += usize::from(p.plastic_ratio != 1.0);
    }

    assert_eq!(plastic, state.n_particles_plastic, "particles that have yielded by step {step}");

    let mut nodes = Vec::new();
    simulation.grid_nodes(&mut nodes);
    let mass: f64 = nodes.iter().map(|node| node.mass).sum();
    assert!((mass / state.grid_mass - 1.0).abs() < 1e-11, "step {step}: {mass} kg on the grid");

    for a in 0..3 {
        let momentum: f64 = nodes.iter().map(|node| node.mass * node.velocity[a]).sum();
        let off = (momentum - state.grid_momentum_after_forces[a]).abs();
        assert!(off < 1e-11 * 10.0, "step {step}: the grid's momentum is off by {off:e} kg m/s");
    }
}

#[test]
fn golden_steps_agree_after_1_2_10_and_40() {
    let golden: Golden = golden::document("mpm/full_step_golden.json");
    assert_eq!(golden.states.iter().map(|s| s.step).collect::<Vec<_>>(), [1, 2, 10, 40]);
    for volume in [Vec::new(), golden.V0.clone()] {
        let mut simulation = scene(&golden, volume).simulate(Precision::F64);
        for state in &golden.states {
            let taken = simulation.step_count();
            advance(&mut simulation, state.step - taken);
            compare(&simulation, state);
        }
    }
}

#[test]
fn golden_volumes_come_from_the_density_on_the_grid() {
    let golden: Golden = golden::document("mpm/full_step_golden.json");
    let simulation = scene(&golden, Vec::new()).simulate(Precision::F64);
    let every: Vec<usize> = (0..golden.V0.len()).collect();
    let volumes = crate::volumes::volumes(simulation, &free_snow(), &every);
    for (i, (own, golden)) in volumes.iter().zip(&golden.V0).enumerate() {
        assert!((own / golden - 1.0).abs() < 1e-11, "particle {i}: {own} m³, not {golden}");
    }
}
