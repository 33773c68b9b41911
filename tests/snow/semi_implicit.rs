//! Semi-implicit steps: the explicit ones at small dt, stable at large ones, nothing from a failed
//! solve.
#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use nappe_sim::{
    linalg::Stop,
    math::Precision,
    report::{NoStopwatch, StepFailure},
    snow::{Blend, Integration, Kernel, ParticleState, Transfer},
    time_step::TimeStep,
    world::Simulation,
};
use nappe_tests::{
    networks::scatter,
    scene::{cross, difference, norm},
    snow::{SnowScene, Variant, elastic, lattice, object, order, rework, step_once, wave_modulus},
};

const H: f64 = 0.1;
const DENSITY: f64 = 400.0;
const EXACT: Stop = Stop::Residual { tolerance: 1e-12, max_iterations: 2000 };

fn speed() -> f64 {
    (wave_modulus(&elastic(1.4e5, 0.2)) / DENSITY).sqrt()
}

/// A free block, stretched at random by `size`, that moves.
fn block(variant: Variant, integration: Integration, courant: f64, size: f64) -> (SnowScene, Simulation) {
    let x = lattice([0.03, -0.21, 0.14], [6; 3], [0.5 * H; 3]);
    let body = object("block", x, (0.5 * H).powi(3), DENSITY, elastic(1.4e5, 0.2));
    let mut scene = SnowScene::new(vec![body], H, courant * H / speed()).by(variant);
    scene.settings.integration = integration;
    let mut simulation = scene.simulate(Precision::F64);
    rework(&mut simulation, |i, p| {
        for k in 0..9 {
            p.elastic[k / 3][k % 3] += size * scatter(9 * i + k);
        }
        p.v = [0, 1, 2].map(|a| 10.0 * size * scatter(5000 + 3 * i + a));
    });
    (scene, simulation)
}

/// Largest difference of velocities.
fn apart(a: &[ParticleState], b: &[ParticleState]) -> f64 {
    a.iter().zip(b).map(|(p, q)| norm(difference(p.v, q.v))).fold(0.0, f64::max)
}

#[test]
fn a_semi_implicit_step_is_the_explicit_one_but_for_the_square_of_dt() {
    for kernel in [Kernel::Quadratic, Kernel::Cubic] {
        for transfer in [Transfer::Apic, Transfer::Mls, Transfer::PicFlip(Blend::PerStep(0.95))] {
            let variant = Variant { kernel, transfer };
            for beta in [0.5, 1.0] {
                let gaps = [0.1, 0.05, 0.025].map(|courant| {
                    let implicit = Integration::SemiImplicit { beta, stop: EXACT };
                    let [a, b] = [Integration::Explicit, implicit].map(|integration| {
                        let (_, mut simulation) = block(variant, integration, courant, 0.02);
                        step_once(&mut simulation);
                        simulation.snow_particles()
                    });

                    apart(&a, &b)
                });

                let orders = [0, 1].map(|i| order(gaps[i], gaps[i + 1], 2.0));
                println!(
                    "{} beta {beta}: {:.2?} of 1e-6 m/s apart, orders {orders:.2?}",
                    variant.name(),
                    gaps.map(|g| 1e6 * g)
                );
                assert!(orders[1] > 1.9, "{} beta {beta}: {orders:?}", variant.name());
            }
        }
    }
}

#[test]
fn with_beta_0_it_is_the_explicit_step() {
    let variant = Variant { kernel: Kernel::Quadratic, transfer: Transfer::Mls };
    let none = Integration::SemiImplicit { beta: 0.0, stop: EXACT };
    let [a, b] = [Integration::Explicit, none].map(|integration| {
        let (_, mut simulation) = block(variant, integration, 0.2, 0.02);
        step_once(&mut simulation);
        simulation.snow_particles()
    });
    assert!(apart(&a, &b) < 1e-12, "{:e}", apart(&a, &b));
}

#[test]
fn backward_euler_is_stable_and_loses_energy_at_ten_times_the_explicit_limit() {
    let stop = Stop::Residual { tolerance: 1e-8, max_iterations: 2000 };
    let integration = Integration::SemiImplicit { beta: 1.0, stop };
    for kernel in [Kernel::Quadratic, Kernel::Cubic] {
        // FLIP keeps velocities that the grid does not see, and the solve does not damp: it is left out.
        for transfer in [Transfer::Apic, Transfer::Mls] {
            let variant = Variant { kernel, transfer };
            // The limit of a particle alone is 0.816 h / c (quadratic, MLS), and no other is greater
            // by more than 1.16.
            let courant = 10.0 * 0.816 * 1.16;
            let (_, mut simulation) = block(variant, integration, courant, 1e-3);
            let start = simulation.diagnose().total_energy();
            let mut last = start;

            for step in 0..100 {
                let report = step_once(&mut simulation);
                let energy = report.diagnostics.total_energy();
                assert!(
                    energy <= last * (1.0 + 1e-9),
                    "{} step {step}: {last} J to {energy} J",
                    variant.name()
                );
                let solve = report.solve.expect("a report of the solve");
                assert!(solve.relative_residual <= 1e-8, "{solve:?}");
                let substeps = report.snow.expect("snow").substeps;
                assert_eq!(report.work.force_evaluations, u64::from(substeps));
                assert!(report.work.matrix_products >= u64::from(solve.products));
                last = energy;
            }

            println!("{}: energy from {start:.3e} to {last:.3e} J in 100 steps", variant.name());

            // The explicit step blows up within these.
            let (_, mut explicit) = block(variant, Integration::Explicit, courant, 1e-3);
            let failed = (0..100).any(|_| explicit.step(&mut NoStopwatch).is_err());
            assert!(failed, "{}: the explicit step bears it", variant.name());
        }
    }
}

#[test]
fn what_turns_in_free_flight_never_gains_a_hundredth_of_its_energy() {
    let flip = Transfer::PicFlip(Blend::PerStep(0.95));
    for (kernel, transfer, beta) in [
        (Kernel::Quadratic, Transfer::Mls, 0.5),
        (Kernel::Quadratic, Transfer::Mls, 1.0),
        (Kernel::Cubic, Transfer::Apic, 0.5),
        (Kernel::Quadratic, flip, 0.5),
    ] {
        // Two cells by four by two, in frames of 48 times what elastic waves allow an explicit step.
        let spin = [0.0, 0.0, 2.0];
        let x = lattice([-H, -2.0 * H, -H], [4, 8, 4], [0.5 * H; 3]);
        let mut body = object("block", x, (0.5 * H).powi(3), DENSITY, elastic(1.4e5, 0.2));
        body.angular_velocity = spin;
        let variant = Variant { kernel, transfer };
        let mut scene = SnowScene::new(vec![body], H, 0.1).by(variant).moving(|x| cross(spin, x));
        scene.settings.time_step = TimeStep::Certified { safety: 1.0 };
        let stop = Stop::Residual { tolerance: 1e-4, max_iterations: 500 };
        scene.settings.integration = Integration::SemiImplicit { beta, stop };

        let mut simulation = scene.simulate(Precision::F64);
        let start = simulation.diagnose().total_energy();
        let energies = (0..100).map(|_| step_once(&mut simulation).diagnostics.total_energy() / start);
        let most = energies.fold(0.0, f64::max);
        println!("{} beta {beta}: at most {most:.5} of the energy at the start", variant.name());
        assert!(most < 1.01, "{} beta {beta}: {most} times the energy at the start", variant.name());
    }
}

#[test]
fn a_beta_that_elastic_waves_bound_is_refused() {
    let variant = Variant { kernel: Kernel::Quadratic, transfer: Transfer::Mls };
    let (mut scene, _) = block(variant, Integration::Explicit, 0.2, 0.0);
    for (beta, is_allowed) in [
        (0.0, true),
        (0.25, false),
        (0.499, false),
        (0.5, true),
        (1.0, true),
        (1.01, false),
        (f64::NAN, false),
    ] {
        scene.settings.integration = Integration::SemiImplicit { beta, stop: EXACT };
        let refused = Simulation::new(&scene.setup(), Precision::F64).err().map(|error| error.to_string());
        let message = format!(
            "snow: beta is {beta}: 0 or 0.5 to 1 is needed; below 0.5 elastic waves bound the step as they bound an explicit one"
        );
        assert_eq!(refused, (!is_allowed).then_some(message));
    }
}

#[test]
fn a_solve_that_fails_commits_nothing() {
    let variant = Variant { kernel: Kernel::Quadratic, transfer: Transfer::Mls };
    let stop = Stop::Residual { tolerance: 1e-14, max_iterations: 1 };
    let (_, mut simulation) = block(variant, Integration::SemiImplicit { beta: 1.0, stop }, 8.0, 1e-3);
    let before = simulation.state_hash();
    let error = simulation.step(&mut NoStopwatch).expect_err("one iteration is not enough");
    assert!(matches!(error.failure, StepFailure::Solver { .. }), "{error}");
    assert_eq!(simulation.state_hash(), before, "nothing has moved");
}
