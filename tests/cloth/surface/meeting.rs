//! Two free sheets that meet keep their momentum, gain no energy, and hardly part again.

use nappe_sim::{linalg::Stop, math::Precision};
use nappe_tests::{
    Scene,
    scene::{difference, momenta, norm, velocities},
    sheets::{Sheet, together},
    surface::{Watched, scene},
};

const SIDE: usize = 12;

/// Speed (m/s) at which one comes to the other.
const SPEED: f64 = 5.0;

/// Two sheets without gravity, of these masses per area (kg/m²): the first one flies up to the second one.
fn meeting(densities: [f64; 2]) -> Scene {
    let sheet = |layer: usize| {
        let middle = [0.003 * layer as f64, 0.06 * layer as f64, 0.002 * layer as f64];
        let level = Sheet::level(SIDE, 0.02, middle, 0.2 * layer as f64);
        Sheet { density: densities[layer], ripple: 2e-4, ..level }.network()
    };
    let mut network = together(&[sheet(0), sheet(1)]);
    network.v[..SIDE * SIDE].fill([0.0, SPEED, 0.0]);
    let mut scene = scene(network, 2e-3, 0.0).under([0.0; 3]);
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-13, max_iterations: 3000 };
    scene
}

/// The mean speed (m/s) at which the second sheet goes away from the first.
fn parting(watched: &Watched, masses: &[f64]) -> f64 {
    let v = velocities(&watched.simulation);
    let mean = |part: std::ops::Range<usize>| {
        let mass: f64 = masses[part.clone()].iter().sum();
        part.map(|i| masses[i] * v[i][1]).sum::<f64>() / mass
    };
    mean(SIDE * SIDE..2 * SIDE * SIDE) - mean(0..SIDE * SIDE)
}

#[test]
fn two_free_sheets_that_meet_keep_their_momentum_and_hardly_part() {
    for densities in [[0.1, 1.0], [1.0, 0.1], [0.25, 0.25]] {
        let scene = meeting(densities);
        let masses = &scene.network.masses;
        let mut watched = Watched::new(&scene, Precision::F64);
        let start = watched.simulation.diagnose().total_energy();
        let (before, _) = momenta(&watched.simulation, masses);
        assert!(parting(&watched, masses) < -0.99 * SPEED, "they come together");
        for step in 1..=40 {
            watched.go(1);
            let (after, _) = momenta(&watched.simulation, masses);
            let off = norm(difference(after, before)) / norm(before);
            assert!(off < 1e-10, "{densities:?}, step {step}: off by {off:e} of the momentum");
        }

        let tally = watched.tally;
        assert_eq!(tally.complaint(), None, "{densities:?}");
        // Contact gives none. What a linear solve gives to triangles that turn is far below this.
        assert!(tally.energy < 1.001 * start, "{densities:?}: {} J of {start} J", tally.energy);
        let parts = parting(&watched, masses) / SPEED;
        assert!((-0.01..0.2).contains(&parts), "{densities:?}: they part at {parts} of their speed");
    }
}
