//! Normal modes of chains and nets, a spinning ring, and a chain's motion along an oblique line.

use std::f64::consts::PI;

use nappe_sim::{
    cloth::{Integrator, Network, SpringLaw, SpringRules},
    math::Precision,
    mesh::TriangleMesh,
};
use nappe_tests::{
    Scene,
    golden::document,
    networks::{chain, particles, spring},
    scene::{advance, cross, difference, momenta, norm, positions, velocities},
};
use serde::Deserialize;

#[derive(Deserialize)]
struct Modes {
    longitudinal: Vec<Longitudinal>,
    transverse_prestretched: Transverse,
    longitudinal_transient: LineMotion,
}

#[derive(Deserialize)]
struct Longitudinal {
    boundary: String,
    n_free: usize,
    k: f64,
    m: f64,
    omega_rad_s: Vec<f64>,
}

#[derive(Deserialize)]
struct Transverse {
    n_free: usize,
    k: f64,
    m: f64,
    l0: f64,
    spacing: f64,
    omega_rad_s: Vec<f64>,
}

#[derive(Deserialize)]
struct LineMotion {
    n_free: usize,
    k: f64,
    m: f64,
    l0: f64,
    direction: [f64; 3],
    cases: Vec<LineCase>,
}

#[derive(Deserialize)]
struct LineCase {
    nu: f64,
    states: Vec<LineState>,
}

#[derive(Deserialize)]
struct LineState {
    t: f64,
    displacement_along_line: Vec<f64>,
    velocity_along_line: Vec<f64>,
}

fn modes() -> Modes {
    document("spring_mass/chain_modes.json")
}

/// Particles at spacing 1 along x.
fn line(count: usize, spacing: f64) -> Vec<[f64; 3]> {
    (0..count).map(|i| [spacing * i as f64, 0.0, 0.0]).collect()
}

/// ω² of a mode: the network starts from rest in it; leapfrog makes the second difference of its
/// amplitude -ω² dt² times it, whatever dt. `guess` (rad/s) only sets a good dt.
fn frequency(network: &Network, mode: &[[f64; 3]], amplitude: f64, guess: f64) -> f64 {
    let mut displaced = network.clone();
    for (x, shape) in displaced.x.iter_mut().zip(mode) {
        *x = [0, 1, 2].map(|c| x[c] + amplitude * shape[c]);
    }

    let dt = 1.0 / guess;
    let mut scene = Scene::new(displaced, dt);
    scene.settings.integrator = Integrator::VelocityVerlet;
    let mut simulation = scene.simulate(Precision::F64);
    let project = |x: &[[f64; 3]]| -> f64 {
        let dots = (0..x.len()).map(|i| {
            let d = difference(x[i], network.x[i]);
            d[0] * mode[i][0] + d[1] * mode[i][1] + d[2] * mode[i][2]
        });

        dots.sum()
    };

    let mut amplitudes = [project(&positions(&simulation)), 0.0, 0.0];
    for later in &mut amplitudes[1..] {
        advance(&mut simulation, 1);
        *later = project(&positions(&simulation));
    }

    let [first, second, third] = amplitudes;
    ((2.0 * second - first - third) / (dt * dt * second)).sqrt()
}

#[test]
fn a_chain_has_its_longitudinal_frequencies() {
    for case in modes().longitudinal {
        let fixed = case.boundary == "fixed-fixed";
        let count = case.n_free + if fixed { 2 } else { 1 };
        let mut network = chain(&line(count, 0.1), 0.1, case.k, 0.0, case.m);
        network.pins = if fixed { vec![0, count as u32 - 1] } else { vec![0] };
        for (j, expected) in case.omega_rad_s.iter().enumerate() {
            let wave = if fixed {
                (j + 1) as f64 * PI / (case.n_free + 1) as f64
            } else {
                (2 * j + 1) as f64 * PI / (2 * case.n_free + 1) as f64
            };

            let mode: Vec<_> = (0..count).map(|i| [(wave * i as f64).sin(), 0.0, 0.0]).collect();
            let found = frequency(&network, &pinned_still(mode, &network.pins), 1e-4, *expected);
            let error = (found / expected - 1.0).abs();
            assert!(error < 1e-9, "{} {}, mode {}: {error:e}", case.boundary, case.n_free, j + 1);
        }
    }
}

fn pinned_still(mut mode: Vec<[f64; 3]>, pins: &[u32]) -> Vec<[f64; 3]> {
    for &pin in pins {
        mode[pin as usize] = [0.0; 3];
    }

    mode
}

#[test]
fn a_stretched_chain_has_its_transverse_frequencies() {
    let case = modes().transverse_prestretched;
    let count = case.n_free + 2;
    let mut network = chain(&line(count, case.spacing), case.l0, case.k, 0.0, case.m);
    network.pins = vec![0, count as u32 - 1];
    for (j, expected) in case.omega_rad_s.iter().enumerate() {
        let wave = (j + 1) as f64 * PI / (case.n_free + 1) as f64;
        for across in [[0.0, 1.0, 0.0], [0.0, 0.6, -0.8]] {
            let shape = |i: usize| across.map(|c| c * (wave * i as f64).sin());
            let mode = pinned_still((0..count).map(shape).collect(), &network.pins);

            // The law is linear up to the square of amplitude over spacing.
            let found = frequency(&network, &mode, 1e-5 * case.spacing, *expected);
            let error = (found / expected - 1.0).abs();
            assert!(error < 1e-6, "mode {}: {error:e}", j + 1);
        }
    }
}

#[test]
fn a_stretched_net_has_its_transverse_frequencies() {
    // ω² = 4 T / (m a) (sin²(p π / 2(n+1)) + sin²(q π / 2(n+1))) for n x n free particles.
    let (free, a, k, m, stretch) = (5, 0.1, 200.0, 0.02, 1.25);
    let side = free + 2;
    let rules = SpringRules { stretch: SpringLaw { stiffness: k, damping: 0.0 }, shear: None, bend: None };
    let mesh = TriangleMesh::grid(side, side, a / stretch);
    let mut network = Network::from_lattice(&mesh, [side, side], &rules, m);
    network.x.iter_mut().for_each(|x| *x = x.map(|c| c * stretch));
    let border = |i: usize| [i % side, i / side].iter().any(|&c| c == 0 || c == side - 1);
    network.pins = (0..side * side).filter(|&i| border(i)).map(|i| i as u32).collect();
    let tension = k * (a - a / stretch);
    for p in 1..=free {
        for q in 1..=free {
            let [half_p, half_q] = [p, q].map(|p| p as f64 * PI / (2 * (free + 1)) as f64);
            let expected = (4.0 * tension / (m * a) * (half_p.sin().powi(2) + half_q.sin().powi(2))).sqrt();
            let height = |i: usize| {
                (2.0 * half_p * (i % side) as f64).sin() * (2.0 * half_q * (i / side) as f64).sin()
            };

            let mode = pinned_still((0..side * side).map(|i| [0.0, height(i), 0.0]).collect(), &network.pins);
            let found = frequency(&network, &mode, 1e-5 * a, expected);
            let error = (found / expected - 1.0).abs();
            assert!(error < 1e-6, "mode ({p}, {q}): {error:e}");
        }
    }
}

#[test]
fn a_chain_moves_along_an_oblique_line_as_its_modes_do() {
    let motion = modes().longitudinal_transient;
    for case in &motion.cases {
        let count = motion.n_free + 2;
        let at = |s: f64| motion.direction.map(|d| d * s);
        let start = |i: usize| at(motion.l0 * i as f64 + case.states[0].displacement_along_line[i]);
        let x: Vec<_> = (0..count).map(start).collect();
        let mut network = chain(&x, motion.l0, motion.k, case.nu, motion.m);
        network.pins = vec![0, count as u32 - 1];
        let run = |dt: f64| {
            let mut scene = Scene::new(network.clone(), dt);
            scene.settings.integrator = Integrator::VelocityVerletPredicted;
            let mut simulation = scene.simulate(Precision::F64);
            let sample = |state: &LineState| {
                let missing = (state.t / dt).round() as u64 - simulation.step_count();
                advance(&mut simulation, missing);
                [positions(&simulation), velocities(&simulation)]
            };

            case.states.iter().map(sample).collect::<Vec<_>>()
        };

        let (coarse, fine) = (run(2e-5), run(1e-5));
        for (n, state) in case.states.iter().enumerate() {
            for i in 0..count {
                let extrapolated = |field: usize| {
                    [0, 1, 2].map(|c| (4.0 * fine[n][field][i][c] - coarse[n][field][i][c]) / 3.0)
                };

                let x = at(motion.l0 * i as f64 + state.displacement_along_line[i]);
                let v = at(state.velocity_along_line[i]);

                // The stiffest mode, 3 mm at ω dt = 4e-3, is out of phase by φ = ω t (ω dt)² / 24 < 2e-4:
                // after extrapolation φ² is left, and the rounding of the steps.
                let errors = [norm(difference(extrapolated(0), x)), norm(difference(extrapolated(1), v))];
                assert!(errors[0] < 1e-10, "nu {} at {} s: {errors:?}", case.nu, state.t);
                assert!(errors[1] < 1e-8, "nu {} at {} s: {errors:?}", case.nu, state.t);
            }
        }
    }
}

#[test]
fn a_spinning_ring_keeps_its_length_and_angular_momentum() {
    // l = l0 / (1 - m W² / (4 k sin²(π/n))); leapfrog turns by φ a step with W = 2 sin(φ/2) / dt.
    let (n, k, m, l0, dt, phi) = (12_usize, 400.0, 0.05, 0.2, 1e-3, 0.01_f64);
    let half = (PI / n as f64).sin();
    let rate = 2.0 * (phi / 2.0).sin() / dt;
    let length = l0 / (1.0 - m * rate * rate / (4.0 * k * half * half));
    let radius = length / (2.0 * half);
    let angle = |i: usize| 2.0 * PI * i as f64 / n as f64;
    for (integrator, speed, lag) in [
        (Integrator::VelocityVerlet, radius * phi.sin() / dt, 0.0),
        (Integrator::VelocityVerletPredicted, radius * phi.sin() / dt, 0.0),
        (Integrator::SymplecticEuler, radius * rate, phi / 2.0),
    ] {
        let x: Vec<_> = (0..n).map(|i| [radius * angle(i).cos(), 0.0, -radius * angle(i).sin()]).collect();
        let mut ring = particles(&x, m);
        let heading = |i: usize| angle(i) - lag;
        ring.v = (0..n).map(|i| [-speed * heading(i).sin(), 0.0, -speed * heading(i).cos()]).collect();
        ring.springs = (0..n as u32).map(|i| spring([i, (i + 1) % n as u32], l0, k, 0.0)).collect();
        let mut scene = Scene::new(ring.clone(), dt);
        scene.settings.integrator = integrator;
        let mut simulation = scene.simulate(Precision::F64);
        let (_, before) = momenta(&simulation, &ring.masses);
        advance(&mut simulation, 1000);
        let after = positions(&simulation);
        for i in 0..n {
            let error = (norm(difference(after[(i + 1) % n], after[i])) / length - 1.0).abs();
            assert!(error < 1e-8, "{integrator:?}, spring {i}: {error:e}");
        }

        let (_, turning) = momenta(&simulation, &ring.masses);
        let error = norm(difference(turning, before)) / norm(before);
        assert!(error < 1e-12, "{integrator:?}: angular momentum {error:e}");
        assert!(norm(cross(turning, [0.0, 1.0, 0.0])) < 1e-12 * norm(before), "{integrator:?}: axis");
    }
}

#[test]
fn two_masses_swing_with_their_reduced_mass() {
    let (k, masses) = (60.0_f64, [1.0, 2.5_f64]);
    let omega = (k * (1.0 / masses[0] + 1.0 / masses[1])).sqrt();
    let mut network = chain(&[[0.0; 3], [1.0, 0.0, 0.0]], 1.0, k, 0.0, 1.0);
    network.masses = masses.to_vec();
    let mode = [[1.0 / masses[0], 0.0, 0.0], [-1.0 / masses[1], 0.0, 0.0]];
    let found = frequency(&network, &mode, 1e-3, omega);
    assert!((found / omega - 1.0).abs() < 1e-10, "{found} rad/s, not {omega}");
}
