//! Sub-steps of cloth: accepted or taken again, shared by all cloths, with an estimate of their error.

use nappe_scene::{NoMeshes, Scene as SceneFile, SceneLimits, shipped_scenes};
use nappe_sim::{
    cloth::{Hessian, Integrator, Minimizer, Network, StateLimits},
    linalg::Stop,
    math::Precision,
    report::{BoundKind, StepFailure, StepReport},
    world::{Change, Simulation},
};
use nappe_tests::{
    Method, Scene,
    networks::{chain, particles, scatter, sheet, sheet_rules, spring},
    scene::{advance, difference, max_distance, norm, positions, try_advance, velocities},
    threads::with_threads,
};

const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];
const LOOSE: Stop = Stop::Residual { tolerance: 1e-4, max_iterations: 200 };

/// Sub-steps and rejections of a report.
fn counts(report: &StepReport) -> (u32, u32) {
    let steps = report.cloth.expect("a cloth");
    (steps.substeps, steps.rejected)
}

#[test]
fn shipped_scenes_of_implicit_cloth_are_accepted_as_they_are() {
    with_threads(0, || {
        for (name, text) in shipped_scenes() {
            let scene = SceneFile::parse(text, name).expect("a scene that is shipped");
            let built = scene.build(&NoMeshes, &SceneLimits::default()).expect("a scene that is shipped");
            if built.setup.bodies.is_empty() {
                continue;
            }
            let (mut simulation, _) =
                Simulation::new(&built.setup, Precision::F32).expect("a scene that is shipped");
            simulation.apply(&built.initial_changes).expect("changes of the scene itself");
            let count = (300_000 / simulation.particle_count() as u64).clamp(15, 150);
            // What comes too close to itself is taken again, shorter: one in twenty; what folds as it lands one in fifty.
            let is_thick = built.setup.bodies.iter().any(|body| body.network.thickness > 0.0);
            let all = (0..count).map(|_| counts(&advance(&mut simulation, 1)));
            let (taken, again) = all.fold((0, 0), |sum, told| (sum.0 + told.0, sum.1 + told.1));
            let share = if is_thick { 20 } else { 50 };
            assert!(share * again <= taken, "{name}: {taken} sub-steps, {again} taken again");
        }
    });
}

/// A sheet that spins freely about its middle at `omega` (rad/s).
fn spinning(omega: f64, stiffness: f64) -> Scene {
    let mut network = sheet(12, 0.05, &sheet_rules(stiffness, 0.0), 0.01);
    network.pins.clear();
    for (x, v) in network.x.iter().zip(&mut network.v) {
        *v = [-omega * (x[2] - 0.275), 0.0, omega * (x[0] - 0.275)];
    }
    let mut scene = Scene::new(network, 1.0 / 60.0).certified();
    (scene.settings.minimizer, scene.settings.solver.stop) = (Minimizer::OneStep, LOOSE);
    scene
}

#[test]
fn every_implicit_method_carries_what_spins_slowly_or_is_soft() {
    for method in Method::all().into_iter().filter(|method| method.integrator.is_implicit()) {
        // The midpoint may gain less: by one solve it is divided where the sheet is stiff, at its minimum where the soft
        // one starts to stretch.
        let speeds = match (method.integrator, method.minimizer) {
            (Integrator::ImplicitMidpoint, Minimizer::OneStep) => [0.5, 3.0],
            (Integrator::ImplicitMidpoint, _) => [1.0, 3.0],
            _ => [1.0, 10.0],
        };
        for (omega, stiffness) in speeds.into_iter().zip([1e4, 1e2]) {
            let mut simulation = spinning(omega, stiffness).by(method).simulate(Precision::F64);
            for _ in 0..50 {
                let found = counts(&advance(&mut simulation, 1));
                assert_eq!(found, (1, 0), "{}, {omega} rad/s, {stiffness} N/m", method.name());
            }
        }
    }
}

#[test]
fn a_stiff_sheet_that_spins_is_stepped_finely_until_it_may_go_on() {
    for precision in Precision::ALL {
        // Slow or soft, one solve per step carries it.
        for (omega, stiffness) in [(1.0, 1e4), (10.0, 1e2), (30.0, 1e2)] {
            let mut simulation = spinning(omega, stiffness).simulate(precision);
            for _ in 0..50 {
                assert_eq!(counts(&advance(&mut simulation, 1)), (1, 0), "{omega} rad/s, {stiffness} N/m");
            }
        }

        let mut simulation = spinning(30.0, 1e6).simulate(precision);
        let start = simulation.diagnose().total_energy();
        let first = advance(&mut simulation, 1);
        let (substeps, rejected) = counts(&first);
        assert!(rejected == 3 && substeps > 3, "{first:?}");
        let lengths: Vec<f64> = first.rejections.iter().map(|rejection| rejection.dt * 60.0).collect();
        assert_eq!(lengths, [1.0, 0.5, 0.25]);
        for rejection in &first.rejections {
            let is_one =
                matches!(rejection.cause, StepFailure::Descent { .. } | StepFailure::EnergyGain { .. });
            assert!(is_one && rejection.body == "body" && rejection.time < 1.0 / 60.0, "{rejection:?}");
        }
        let end = advance(&mut simulation, 60);
        assert!(end.diagnostics.total_energy() <= start, "{precision}");
        assert_eq!(counts(&end), (1, 0), "{precision}: it has grown back");
        assert_eq!(end.cloth.expect("a cloth").bound.kind, BoundKind::Frame);
    }
}

#[test]
fn a_step_that_gains_energy_is_rejected_for_that() {
    // Its potential falls as predicted; what the tangents stretch is more than what the solve takes off its speed.
    for (omega, stiffness) in [(3.0, 1e5), (10.0, 1e4)] {
        let first = advance(&mut spinning(omega, stiffness).simulate(Precision::F64), 1);
        let [rejection] = &first.rejections[..] else { panic!("{first:?}") };
        let StepFailure::EnergyGain { value, limit, .. } = rejection.cause else { panic!("{rejection:?}") };
        assert!(value > limit && limit > 0.0, "{rejection:?}");
    }
}

#[test]
fn a_rejected_step_grows_back_after_four_good_ones_and_keeps_the_times_of_frames() {
    let mut simulation = spinning(30.0, 1e6).simulate(Precision::F64);
    let mut lengths = Vec::new();
    for step in 1..=5 {
        let report = advance(&mut simulation, 1);
        assert_eq!(report.time, f64::from(step) / 60.0);
        lengths.push(report.cloth.expect("a cloth").dt * 60.0);
    }
    // Four of an eighth, then two of a quarter; two more of these, then halves: two of them end a step.
    assert_eq!(lengths, [0.25, 0.5, 0.5, 0.5, 1.0]);
}

#[test]
fn a_step_that_no_length_mends_fails_as_it_was() {
    // The pins at its ends are drawn apart by more than the limit allows, which parts of the step come to in the end.
    let x: Vec<_> = (0..5).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect();
    let network = Network { pins: vec![0, 4], ..chain(&x, 0.1, 100.0, 0.0, 0.01) };
    let mut scene = Scene::new(network, 0.01).certified();
    scene.settings.limits = StateLimits { max_stretch: Some(1.5), max_energy: None };
    let mut simulation = scene.simulate(Precision::F64);
    advance(&mut simulation, 3);
    let change = Change::Pin { particle: 4, target: [0.8, 0.0, 0.0], duration: 0.01 };
    simulation.apply(&[change]).expect("a pin");
    let before = simulation.state_hash();
    let error = try_advance(&mut simulation, 1).expect_err("twice as long");
    assert!(matches!(error.failure, StepFailure::Stretch { pin: Some(4), .. }), "{error}");
    assert!(error.to_string().contains("particle 4, a pin that was moved within the step"), "{error}");
    assert_eq!(simulation.state_hash(), before);
}

#[test]
fn a_limit_that_a_long_step_leaves_is_kept_by_shorter_ones() {
    // One step of the clamped Hessian overshoots where the sheet is squeezed.
    let mut scene = squeezed();
    scene.settings.hessian = Hessian::Clamped;
    scene.dt = 0.05;
    let unlimited = advance(&mut scene.clone().simulate(Precision::F64), 1);
    scene = scene.certified();
    let mut limited = scene.clone();
    limited.settings.limits.max_stretch = Some(1.05 * unlimited.diagnostics.max_stretch.min(1.3));
    let mut simulation = limited.simulate(Precision::F64);
    for _ in 0..20 {
        let report = advance(&mut simulation, 1);
        let limit = limited.settings.limits.max_stretch.unwrap_or(0.0);
        assert!(report.diagnostics.max_stretch <= limit, "{report:?}");
    }
}

/// A sheet that is squeezed: its tangent is indefinite.
fn squeezed() -> Scene {
    let mut network = sheet(12, 0.05, &sheet_rules(200.0, 0.0), 0.002);
    for (i, x) in network.x.iter_mut().enumerate() {
        *x = [0.7 * x[0], 1e-3 * scatter(i), 0.7 * x[2]];
    }
    Scene::new(network, 0.01)
}

#[test]
fn pins_arrive_in_time_however_steps_are_divided() {
    let mut scene = spinning(30.0, 1e6).under(GRAVITY);
    scene.network.pins = vec![0, 11];
    scene.settings.limits.max_stretch = Some(1.5);
    let mut simulation = scene.simulate(Precision::F64);
    let target = [0.5, 0.1, 0.1];
    let change = Change::Pin { particle: 11, target, duration: 5.0 / 60.0 };
    simulation.apply(&[change]).expect("a pin");
    let mut rejected = 0;
    for step in 1..=6 {
        rejected += counts(&advance(&mut simulation, 1)).1;
        let way = f64::from(step.min(5)) / 5.0;
        let from = scene.network.x[11];
        let expected = [0, 1, 2].map(|c| from[c] + way * (target[c] - from[c]));
        let distance = max_distance(&[positions(&simulation)[11]], &[expected]);
        assert!(distance < 1e-13, "step {step}: {distance} m");
    }
    assert!(rejected > 0, "it was pulled hard");
}

#[test]
fn cloths_share_their_sub_steps_and_a_fork_goes_on_at_their_pace() {
    let (fast, slow) = (spinning(30.0, 1e6), spinning(0.0, 1e2));
    let mut setup = slow.setup();
    setup.bodies.extend(fast.setup().bodies);
    setup.bodies[0].name = "slow".into();
    let mut simulation = Simulation::new(&setup, Precision::F64).expect("two cloths").0;
    let report = advance(&mut simulation, 1);
    assert!(counts(&report).1 == 3, "{report:?}");
    assert!(report.rejections.iter().all(|rejection| rejection.body == "body"));
    assert!(report.rejections.iter().all(|rejection| rejection.cause.particle() >= Some(144)));

    let mut fork = simulation.fork();
    let mut fresh = Simulation::new(&setup, Precision::F64).expect("two cloths").0;
    advance(&mut fresh, 1);
    for _ in 0..10 {
        assert_eq!(advance(&mut fork, 1), advance(&mut simulation, 1));
        assert_eq!(fork.state_hash(), simulation.state_hash());
    }
}

/// A particle of 1 kg on a spring, pulled by a tenth of a metre: w = 10 rad/s.
fn oscillator() -> Network {
    let mut network = chain(&[[0.0; 3], [1.1, 0.0, 0.0]], 1.0, 100.0, 0.0, 1.0);
    network.pins = vec![0];
    network
}

#[test]
fn the_error_estimate_is_the_error_of_one_step() {
    for integrator in Integrator::ALL {
        for dt in [4e-3, 1e-3, 2.5e-4] {
            // Where speed and elongation are neither 0 nor largest.
            let phase = 0.7_f64;
            let mut scene = Scene::new(oscillator(), dt);
            scene.network.x[1][0] = 1.0 + 0.1 * phase.cos();
            scene.network.v[1][0] = -phase.sin();
            scene.settings.integrator = integrator;
            let mut simulation = scene.simulate(Precision::F64);
            // Methods of order 2 that are implicit know after some steps what their error is.
            let steps = if integrator.is_implicit() && integrator.order() == 2 { 20 } else { 1 };
            advance(&mut simulation, steps - 1);
            let start = [positions(&simulation)[1][0] - 1.0, velocities(&simulation)[1][0]];
            let estimate = advance(&mut simulation, 1).cloth.expect("a cloth").error;
            let (sin, cos) = (10.0 * dt).sin_cos();
            let error = (positions(&simulation)[1][0] - 1.0 - start[0] * cos - 0.1 * start[1] * sin).abs();
            let ratio = estimate.largest / error;
            // Its leading term: what is left out is smaller by w dt.
            assert!((ratio - 1.0).abs() < 20.0 * dt, "{}, dt {dt} s: {ratio}", integrator.name());
            assert_eq!(estimate.rms, estimate.largest, "one free particle");
        }
    }
}

#[test]
fn a_tolerance_keeps_the_estimate_below_it_and_sets_the_length() {
    for integrator in [Integrator::ImplicitEuler, Integrator::SymplecticEuler, Integrator::VelocityVerlet] {
        let substeps = [1e-3, 1e-4, 1e-5].map(|tolerance| {
            let mut scene = Scene::new(oscillator(), 0.05).certified();
            (scene.settings.integrator, scene.settings.tolerance) = (integrator, Some(tolerance));
            let mut simulation = scene.simulate(Precision::F64);
            let (mut substeps, mut rejected) = (0, 0);
            for _ in 0..20 {
                let report = advance(&mut simulation, 1);
                let steps = report.cloth.expect("a cloth");
                assert!(steps.error.largest <= tolerance, "{}: {steps:?}", integrator.name());
                let (more, again) = counts(&report);
                (substeps, rejected) = (substeps + more, rejected + again);
                for rejection in &report.rejections {
                    assert!(matches!(rejection.cause, StepFailure::Inaccurate { .. }), "{rejection:?}");
                }
            }
            assert!(rejected * 5 < substeps, "{}: {rejected} of {substeps} rejected", integrator.name());
            substeps
        });
        // Errors grow with h² or h³: a tenth of the tolerance takes sqrt(10) or cbrt(10) times the steps.
        let expected = if integrator.order() == 1 { 10_f64.sqrt() } else { 10_f64.cbrt() };
        let growth = f64::from(substeps[2]) / f64::from(substeps[1]);
        assert!((growth / expected - 1.0).abs() < 0.3, "{}: {substeps:?}", integrator.name());
    }
}

#[test]
fn implicit_methods_of_order_2_keep_it_where_the_tolerance_sets_the_length() {
    for integrator in [Integrator::ImplicitMidpoint, Integrator::Bdf2] {
        let errors = [6e-5, 4e-6].map(|tolerance| {
            let mut scene = Scene::new(oscillator(), 0.04).certified();
            (scene.settings.integrator, scene.settings.tolerance) = (integrator, Some(tolerance));
            let mut simulation = scene.simulate(Precision::F64);
            let start = [positions(&simulation)[1][0] - 1.0, velocities(&simulation)[1][0]];
            advance(&mut simulation, 25);
            let (sin, cos) = 10.0_f64.sin_cos();
            (positions(&simulation)[1][0] - 1.0 - start[0] * cos - 0.1 * start[1] * sin).abs()
        });
        // Local errors are as h³, so that h² and the global error are as the tolerance to 2/3.
        let order = 1.5 * (errors[0] / errors[1]).log(15.0);
        assert!((order - 1.0).abs() < 0.3, "{}: {errors:?}", integrator.name());
    }
}

#[test]
fn a_tolerance_that_cannot_be_met_is_said() {
    let mut scene = Scene::new(oscillator(), 0.1).certified();
    scene.settings.tolerance = Some(1e-9);
    let error = try_advance(&mut scene.simulate(Precision::F64), 1).expect_err("too fine");
    assert!(matches!(error.failure, StepFailure::Inaccurate { particle: 1, .. }), "{error}");
    assert!(error.to_string().contains("more than the tolerance of 1.0000e-9 m"), "{error}");
}

#[test]
fn the_exact_tangent_of_a_flung_cloth_is_taken_again_where_it_leads_astray() {
    // Squeezed, thrown and stiff: unchecked, it gains energy without end.
    let method = Method::new(Integrator::ImplicitEuler, Hessian::Full);
    let run = |scene: Scene| {
        let mut simulation = scene.simulate(Precision::F64);
        let start = simulation.diagnose().total_energy();
        let mut largest = f64::NEG_INFINITY;
        for _ in 0..60 {
            let Ok(report) = try_advance(&mut simulation, 1) else { return f64::INFINITY };
            largest = largest.max(report.diagnostics.total_energy());
        }
        largest / start
    };
    let mut scene = squeezed().by(method);
    scene.settings.solver.stop = Stop::Iterations(20);
    for spring in &mut scene.network.springs {
        spring.law.stiffness *= 20.0;
    }
    assert!(run(scene.clone()) > 2.0);
    assert!(run(scene.certified()) <= 1.0 + 1e-9);
}

#[test]
fn the_bound_counts_tension_and_damping() {
    // A particle of 1 kg between four pins, on springs of 50 N/m at twice their length.
    let ends = [[0.0; 3], [2.0, 0.0, 0.0], [-2.0, 0.0, 0.0], [0.0, 0.0, 2.0], [0.0, 0.0, -2.0]];
    let (stiffness, tension) = (50.0, 0.5);
    for damping in [0.0, 3.0, 40.0] {
        let springs = (1..5).map(|end| spring([0, end], 1.0, stiffness, damping)).collect();
        let network = Network { springs, pins: vec![1, 2, 3, 4], ..particles(&ends, 1.0) };
        let mut scene = Scene::new(network, 1e-3).certified();
        scene.settings.integrator = Integrator::SymplecticEuler;
        // Two springs along x, two across it; the bound allows neighbours that move against it as far.
        let (k, c) = (2.0 * (2.0 + 2.0 * tension) * stiffness, 2.0 * 2.0 * damping);
        let exact = 4.0 / (c + (c * c + 4.0 * k).sqrt());
        let bound = scene.simulate(Precision::F64).step_bounds()[0].clone();
        assert!(bound.particle == 0 && (bound.dt / exact - 1.0).abs() < 0.01, "{bound:?}, {exact} s");
        assert!(bound.dt <= exact * (1.0 + 1e-12), "{bound:?}, {exact} s");
    }
}

#[test]
fn springs_of_certified_explicit_steps_move_by_a_quarter_of_their_length_at_most() {
    // Let go at twice its length, a chain passes through itself; below the bound on stiffness alone its energy doubles.
    let x: Vec<_> = (0..20).map(|i| [0.2 * f64::from(i), 0.0, 0.0]).collect();
    let mut network = chain(&x, 0.1, 500.0, 0.01, 0.01);
    network.pins = vec![0];
    let mut scene = Scene::new(network, 1.0 / 60.0).certified();
    scene.settings.integrator = Integrator::SymplecticEuler;
    let mut simulation = scene.simulate(Precision::F64);
    let start = simulation.diagnose().total_energy();
    let mut is_bound = false;
    for step in 0..60 {
        let report = advance(&mut simulation, 1);
        let energy = report.diagnostics.total_energy();
        assert!(energy < 1.1 * start, "step {step}: {energy} J of {start} J");
        let bound = report.cloth.expect("a cloth").bound;
        if bound.kind == BoundKind::SpringSpeed {
            is_bound = true;
            let (x, v) = (positions(&simulation), velocities(&simulation));
            let particle = bound.particle.expect("a particle sets it") as usize;
            let fastest = x.len().min(particle + 2);
            let speeds = (particle.max(1)..fastest).map(|i| norm(difference(v[i], v[i - 1])));
            let speed = speeds.fold(0.0, f64::max);
            assert!((bound.dt * speed / 0.025 - 1.0).abs() < 1e-9, "step {step}: {bound:?} at {speed} m/s");
        }
    }
    assert!(is_bound, "they move that fast");
}

#[test]
fn a_rejection_names_the_particle_whose_share_of_the_energy_rose_most() {
    // Of a pair that spins. A particle by itself, another pair and a pin that is moved are faster.
    let mut network = particles(
        &[[5.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0; 3], [1.0, 0.0, 0.0], [7.0, 0.0, 0.0], [8.0, 0.0, 0.0]],
        1.0,
    );
    network.springs = vec![spring([2, 3], 1.0, 1e6, 0.0), spring([4, 5], 1.0, 1.0, 0.0)];
    network.v =
        vec![[0.0, 50.0, 0.0], [0.0; 3], [0.0; 3], [0.0, 30.0, 0.0], [0.0, 40.0, 0.0], [0.0, 40.0, 0.0]];
    network.pins = vec![1];
    let method = Method::new(Integrator::ImplicitEuler, Hessian::Absolute);
    let mut simulation = Scene::new(network, 1.0 / 60.0).by(method).certified().simulate(Precision::F64);
    let change = Change::Pin { particle: 1, target: [20.0, 0.0, 0.0], duration: 1.0 / 60.0 };
    simulation.apply(&[change]).expect("a pin");
    let report = advance(&mut simulation, 1);
    let mut named = report.rejections.iter().map(|rejection| rejection.cause.particle()).peekable();
    assert!(named.peek().is_some() && named.all(|it| matches!(it, Some(2 | 3))), "{:?}", report.rejections);
}
