//! Whole motions against references of order 16, by extrapolation of a second-order integrator.

use nappe_sim::{
    cloth::Integrator,
    math::{Precision, Real},
    report::Diagnostics,
};
use nappe_tests::{
    Scene,
    golden::{GoldenState, Transient},
    scene::{advance, max_distance, positions, velocities},
};

struct Sample {
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    diagnostics: Diagnostics,
}

/// The states on record as the simulation gives them, by `steps` of every 10 ms.
fn run(motion: &Transient, steps: u32, precision: Precision) -> Vec<Sample> {
    let dt = 0.01 / f64::from(steps);
    let mut scene = Scene::new(motion.network.network(), dt).under(motion.network.gravity_m_s2);
    scene.settings.integrator = Integrator::VelocityVerletPredicted;
    let mut simulation = scene.simulate(precision);
    let sample = |state: &GoldenState| {
        let until = (state.t / dt).round() as u64;
        let missing = until - simulation.step_count();
        advance(&mut simulation, missing);
        let diagnostics = simulation.diagnose();
        Sample { x: positions(&simulation), v: velocities(&simulation), diagnostics }
    };

    motion.states.iter().map(sample).collect()
}

/// Removes the error of second order: (4 fine - coarse) / 3.
fn extrapolate(coarse: &[[f64; 3]], fine: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let point = |(c, f): (&[f64; 3], &[f64; 3])| [0, 1, 2].map(|i| (4.0 * f[i] - c[i]) / 3.0);
    coarse.iter().zip(fine).map(point).collect()
}

#[test]
fn chains_and_cloths_move_as_the_references_do() {
    for name in Transient::ALL {
        let motion = Transient::named(name);
        let (coarse, fine) = (run(&motion, 40, Precision::F64), run(&motion, 80, Precision::F64));
        for ((state, coarse), fine) in motion.states.iter().zip(&coarse).zip(&fine) {
            // The references of a motion that compresses springs grow a perturbation: `growth`.
            let distance = max_distance(&extrapolate(&coarse.x, &fine.x), &state.x);
            let step_error = max_distance(&coarse.x, &fine.x);
            let tolerance = 1e-10 + 0.05 * step_error;
            assert!(distance < tolerance, "{name} at {} s: {distance:e} of {tolerance:e} m", state.t);
            let distance = max_distance(&extrapolate(&coarse.v, &fine.v), &state.v);
            let tolerance = 1e-8 + 0.05 * max_distance(&coarse.v, &fine.v);
            assert!(distance < tolerance, "{name} at {} s: {distance:e} of {tolerance:e} m/s", state.t);
        }
    }
}

#[test]
fn energies_follow_the_references() {
    for name in Transient::ALL {
        let motion = Transient::named(name);
        let samples = run(&motion, 80, Precision::F64);
        let scale = motion.states.iter().map(|s| s.kinetic + s.elastic).fold(0.0, f64::max);
        for (state, Sample { diagnostics, .. }) in motion.states.iter().zip(&samples) {
            for (what, found, expected) in [
                ("kinetic", diagnostics.kinetic_energy, state.kinetic),
                ("elastic", diagnostics.elastic_energy, state.elastic),
                ("gravitational", diagnostics.gravitational_energy, state.gravitational),
                ("total", diagnostics.total_energy(), state.total),
            ] {
                let error = (found - expected).abs() / scale;

                // Order 2 at ω dt <= 0.1.
                assert!(error < 1e-3, "{name} at {} s: {what} {found} J, not {expected}", state.t);
            }
        }
    }
}

#[test]
fn binary32_stays_near_the_references() {
    for name in Transient::ALL {
        let motion = Transient::named(name);
        let steps = 20;
        let (single, double) = (run(&motion, steps, Precision::F32), run(&motion, steps, Precision::F64));
        for ((state, single), double) in motion.states.iter().zip(&single).zip(&double) {
            let count = state.t * 100.0 * f64::from(steps);

            // Each step rounds coordinates of at most 2 m; the errors add up as a random walk and
            // grow as perturbations of this motion do, the largest factor so far.
            let growth =
                motion.states.iter().filter(|s| s.t <= state.t).map(|s| s.growth).fold(1.0, f64::max);
            let tolerance = 4.0 * 2.0 * f32::ROUNDING * (1.0 + count.sqrt()) * growth;
            let distance = max_distance(&single.x, &double.x);
            assert!(distance < tolerance, "{name} at {} s: {distance:e} of {tolerance:e} m", state.t);
        }
    }
}
