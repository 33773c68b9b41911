//! Worlds of several bodies, sub-steps, and changes of springs on the way.

use nappe_sim::{
    cloth::{Integrator, SpringKind, SpringLaw, StateLimits},
    linalg::Stop,
    math::Precision,
    report::{NoStopwatch, StepFailure},
    world::{Change, ChangeError, Simulation, WorldSetup},
};
use nappe_tests::{
    Method, Scene,
    networks::{chain, sheet, sheet_rules},
    scene::{advance, momenta, positions, velocities},
};

const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];

fn cloth(method: Method) -> Scene {
    let mut scene =
        Scene::new(sheet(7, 0.1, &sheet_rules(200.0, 0.03), 0.01), 1e-3).by(method).under(GRAVITY);
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-6, max_iterations: 100 };
    scene
}

fn rope(method: Method) -> Scene {
    let x: Vec<_> = (0..12).map(|i| [2.0, 0.0, 0.1 * f64::from(i)]).collect();
    let mut network = chain(&x, 0.09, 80.0, 0.01, 0.02);
    network.pins = vec![0];
    Scene::new(network, 1e-3).by(method).under(GRAVITY).in_substeps(3)
}

/// The bodies of both scenes in one world.
fn together(first: &Scene, second: &Scene) -> WorldSetup {
    let mut setup = first.setup();
    setup.bodies.extend(second.setup().bodies);
    setup.bodies[0].name = String::from("cloth");
    setup.bodies[1].name = String::from("rope");
    setup
}

fn build(setup: &WorldSetup, precision: Precision) -> Simulation {
    Simulation::new(setup, precision).expect("a world of two bodies").0
}

#[test]
fn bodies_in_one_world_move_as_each_does_alone() {
    for method in Method::all() {
        for precision in Precision::ALL {
            // All cloths of a world share the sub-steps of one of them.
            let (cloth, rope) = (cloth(method).in_substeps(3), rope(method));
            let mut alone = [cloth.simulate(precision), rope.simulate(precision)];
            let mut both = build(&together(&cloth, &rope), precision);
            let reports = [advance(&mut alone[0], 50), advance(&mut alone[1], 50)];
            let report = advance(&mut both, 50);
            let expected: Vec<_> = alone.iter().flat_map(positions).collect();
            assert_eq!(positions(&both), expected, "{} in {precision}", method.name());
            let expected: Vec<_> = alone.iter().flat_map(velocities).collect();
            assert_eq!(velocities(&both), expected, "{} in {precision}", method.name());
            let sum: f64 = reports.iter().map(|r| r.diagnostics.total_energy()).sum();
            let error = (report.diagnostics.total_energy() - sum).abs();
            assert!(error < 1e-12 * sum.abs(), "{} in {precision}: {error:e} J", method.name());
            let residuals = reports.map(|r| r.solve.map_or(0.0, |solve| solve.relative_residual));
            let worst = report.solve.map_or(0.0, |solve| solve.relative_residual);
            assert_eq!(worst, residuals[0].max(residuals[1]), "{} in {precision}", method.name());
        }
    }
}

#[test]
fn diagnostics_are_those_of_the_particles() {
    for precision in Precision::ALL {
        let scene = cloth(Method::all()[1]);
        let mut simulation = scene.simulate(precision);
        let diagnostics = advance(&mut simulation, 60).diagnostics;
        assert_eq!(diagnostics, simulation.diagnose(), "{precision}: a report is a diagnosis of the state");
        let network = &scene.network;
        let mut masses = network.masses.clone();
        network.pins.iter().for_each(|&pin| masses[pin as usize] = 0.0);
        let (x, v) = (positions(&simulation), velocities(&simulation));
        let (momentum, _) = momenta(&simulation, &masses);
        let square = |v: [f64; 3]| v.iter().map(|c| c * c).sum::<f64>();
        let kinetic: f64 = v.iter().zip(&masses).map(|(v, m)| 0.5 * m * square(*v)).sum();
        let weight: f64 = x.iter().zip(&masses).map(|(x, m)| 9.81 * m * x[1]).sum();
        let (mut elastic, mut stretch) = (0.0, 0.0_f64);
        for spring in &network.springs {
            let [a, b] = spring.particles.map(|p| x[p as usize]);
            let length = square([0, 1, 2].map(|c| a[c] - b[c])).sqrt();
            elastic += 0.5 * spring.law.stiffness * (length - spring.rest_length).powi(2);
            stretch = stretch.max(length / spring.rest_length);
        }
        // In binary32 masses, stiffnesses and rest lengths are rounded.
        let tolerance = if precision == Precision::F64 { 1e-12 } else { 1e-5 };
        for (found, expected) in [
            (diagnostics.kinetic_energy, kinetic),
            (diagnostics.elastic_energy, elastic),
            (diagnostics.gravitational_energy, weight),
            (diagnostics.max_stretch, stretch),
            (diagnostics.momentum[1], momentum[1]),
        ] {
            assert!(
                (found - expected).abs() < tolerance * expected.abs(),
                "{precision}: {found}, not {expected}"
            );
        }
    }
}

#[test]
fn a_failing_body_leaves_every_body_as_it_was() {
    for method in Method::all() {
        let (cloth, mut rope) = (cloth(method), rope(method));
        rope.settings.limits = StateLimits { max_stretch: Some(1.2), max_energy: None };
        let mut both = build(&together(&cloth, &rope), Precision::F64);
        loop {
            let before = (both.state_hash(), positions(&both), both.diagnose());
            let Err(error) = both.step(&mut NoStopwatch) else { continue };
            assert_eq!(error.body, "rope", "{error}");
            let StepFailure::Stretch { particle, .. } = error.failure else { panic!("{error}") };
            // Particles are counted over all bodies: the rope's begin at 49.
            assert!((49..61).contains(&particle), "{error}");
            assert_eq!((both.state_hash(), positions(&both), both.diagnose()), before, "{error}");
            break;
        }
    }
}

#[test]
fn sub_steps_are_the_steps_of_a_smaller_dt() {
    for method in Method::all() {
        for precision in Precision::ALL {
            let mut coarse = cloth(method);
            coarse.dt = 4e-3;
            let coarse = coarse.in_substeps(4);
            let fine = cloth(method);
            let [mut coarse, mut fine] = [coarse, fine].map(|scene| scene.simulate(precision));
            advance(&mut coarse, 10);
            advance(&mut fine, 40);
            assert_eq!(positions(&coarse), positions(&fine), "{} in {precision}", method.name());
        }
    }
}

#[test]
fn changed_springs_act_as_springs_that_were_always_so() {
    let change = |kind, stiffness, damping| Change::Springs { body: None, kind, stiffness, damping };
    for method in Method::all() {
        let mut changed = cloth(method).simulate(Precision::F64);
        let changes = [
            change(None, Some(300.0), None),
            change(Some(SpringKind::Bend), None, Some(0.07)),
            change(Some(SpringKind::Shear), Some(120.0), Some(0.0)),
        ];
        changed.apply(&changes).expect("fair changes");
        let mut scene = cloth(method);
        for spring in &mut scene.network.springs {
            spring.law = match spring.kind {
                SpringKind::Stretch => SpringLaw { stiffness: 300.0, damping: 0.03 },
                SpringKind::Shear => SpringLaw { stiffness: 120.0, damping: 0.0 },
                SpringKind::Bend => SpringLaw { stiffness: 300.0, damping: 0.07 },
            };
        }

        let mut always = scene.simulate(Precision::F64);
        assert_eq!(changed.step_bounds()[0].dt, always.step_bounds()[0].dt);
        advance(&mut changed, 30);
        advance(&mut always, 30);
        let distance = nappe_tests::scene::max_distance(&positions(&changed), &positions(&always));
        assert!(distance < 1e-13, "{}: {distance:e} m", method.name());
    }
}

#[test]
fn a_change_that_is_refused_names_what_is_wrong_and_changes_nothing() {
    let method = Method { integrator: Integrator::SymplecticEuler, ..Method::all()[0] };
    let mut both = build(&together(&cloth(method), &rope(method)), Precision::F64);
    let springs = |body: Option<&str>, kind, stiffness| Change::Springs {
        body: body.map(str::to_owned),
        kind,
        stiffness,
        damping: None,
    };

    let refused = [
        springs(Some("flag"), None, Some(1.0)),
        springs(Some("rope"), Some(SpringKind::Bend), Some(1.0)),
        springs(None, None, Some(-1.0)),
        Change::Gravity([0.0, f64::NAN, 0.0]),
        Change::Wind([f64::INFINITY, 0.0, 0.0]),
        Change::Drag(-0.5),
        Change::Pin { particle: 61, target: [0.0; 3], duration: 1.0 },
        Change::Pin { particle: 0, target: [0.0; 3], duration: f64::NAN },
    ];
    let mut untouched = build(&together(&cloth(method), &rope(method)), Precision::F64);
    for change in refused {
        // The first is fair, and must not be applied either.
        let error = both.apply(&[Change::Gravity([5.0, 0.0, 0.0]), change.clone()]);
        let known = matches!(
            error,
            Err(ChangeError::UnknownBody { .. }
                | ChangeError::NoSuchSprings { .. }
                | ChangeError::OutOfRange { .. }
                | ChangeError::NoSuchParticle { .. })
        );
        assert!(known, "{change:?}: {error:?}");
    }

    advance(&mut both, 5);
    advance(&mut untouched, 5);
    assert_eq!(both.state_hash(), untouched.state_hash());

    // The rope's pin is the 50th particle of the world.
    both.apply(&[Change::Pin { particle: 49, target: [2.5, 0.5, 0.0], duration: 0.01 }]).expect("a pin");
    advance(&mut both, 10);
    assert_eq!(positions(&both)[49], [2.5, 0.5, 0.0]);
}
