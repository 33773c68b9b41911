//! What a step tells beside its state, where it was taken but its result is doubtful; and sums over sub-steps.

use nappe_sim::{
    cloth::{Hessian, Integrator, OnPass},
    collide::{
        Collider, Contact, Shape, StartInside,
        shape::{Cuboid, Sphere},
    },
    linalg::Stop,
    math::Precision,
    report::{Notices, StepFailure},
    world::{Change, Simulation},
};
use nappe_tests::{
    Method, Scene,
    networks::{particles, sheet, sheet_rules},
    scene::{advance, max_distance, positions, try_advance},
};

use crate::rippled::rippled;

/// A table whose top is 10 cm thick, at y = 0.
fn table() -> Collider {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let top = Cuboid { center: [0.0, -0.05, 0.0], half_extent: [1.0, 0.05, 1.0], axes };
    Collider {
        name: "table".to_owned(),
        shape: Shape::Box(top),
        velocity: [0.0; 3],
        way: None,
        friction: 0.0,
        restitution: 0.0,
        margin: 1e-3,
        contact: Contact::default(),
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::Warn,
    }
}

/// Particles that fall at 3 m/s: one beside the table, three onto it. Number 1 is not the first of these in the order in
/// which they are computed.
fn falling(dt: f64) -> Scene {
    let mut network =
        particles(&[[1.5, 0.05, 0.0], [-0.9, 0.05, 0.9], [0.0, 0.05, 0.0], [0.3, 0.05, 0.2]], 0.1);
    network.v = vec![[0.0, -3.0, 0.0]; 4];
    let mut scene = Scene::new(network, dt);
    scene.colliders = vec![table()];
    scene
}

#[test]
fn particles_that_go_through_a_table_within_a_step_are_noticed() {
    for method in Method::all() {
        let label = method.name();
        let report = advance(&mut falling(0.1).by(method).simulate(Precision::F64), 1);
        assert_eq!(report.contact_count, 0, "{label}: none ends inside");
        let expected = Notices { passed_count: 3, first_passed: Some(1), ..Notices::default() };
        assert_eq!(report.notices, expected, "{label}");

        // With steps or sub-steps in which they come to lie inside they touch it.
        let mut fine = falling(0.02).by(method).simulate(Precision::F64);
        let reports: Vec<_> = (0..5).map(|_| advance(&mut fine, 1)).collect();
        assert!(reports.iter().all(|report| report.notices == Notices::default()), "{label}");
        assert!(reports.iter().any(|report| report.contact_count == 3), "{label}");
        let scene = falling(0.1).by(method).in_substeps(5);
        let report = advance(&mut scene.simulate(Precision::F64), 1);
        assert_eq!(report.notices, Notices::default(), "{label}");
        assert!(report.contact_count >= 3, "{label}: of all sub-steps: {}", report.contact_count);
    }
}

#[test]
fn a_table_that_is_lifted_through_cloth_is_noticed() {
    let mut scene = falling(0.1);
    scene.network.v = vec![[0.0; 3]; 4];
    scene.colliders[0].velocity = [0.0, 3.0, 0.0];
    let report = advance(&mut scene.simulate(Precision::F64), 1);
    assert_eq!(report.notices.passed_count, 3);
}

#[test]
fn what_falls_beyond_the_middle_of_a_thin_table_stays_on_its_top() {
    // After 22 ms each is 16 mm below a top that is 30 mm thick, nearer to its lower side.
    let mut scene = falling(0.022);
    let Shape::Box(top) = &mut scene.colliders[0].shape else { panic!("a box") };
    (top.center[1], top.half_extent[1]) = (-0.015, 0.015);
    for method in Method::all() {
        let mut simulation = scene.clone().by(method).simulate(Precision::F64);
        let report = advance(&mut simulation, 1);
        assert_eq!((report.contact_count, report.notices.passed_count), (3, 0), "{}", method.name());
        for x in &positions(&simulation)[1..] {
            assert!((x[1] - 1e-3).abs() < 1e-12, "{}: at {x:?} m", method.name());
        }
    }
}

/// Sends pin 2 to a height (m) within a step.
fn send(simulation: &mut Simulation, height: f64) {
    let change = Change::Pin { particle: 2, target: [0.0, height, 0.0], duration: 0.1 };
    simulation.apply(&[change]).expect("a pin");
}

#[test]
fn pins_that_are_moved_through_a_table_or_into_it_are_noticed() {
    for (target, expected) in [(-0.2, 1), (-0.05, 1), (0.02, 0)] {
        let mut scene = falling(0.1);
        scene.network.v = vec![[0.0; 3]; 4];
        scene.network.pins = vec![2];
        let mut simulation = scene.simulate(Precision::F64);
        send(&mut simulation, target);
        let notices = advance(&mut simulation, 1).notices;
        let first = (expected == 1).then_some(2);
        assert_eq!((notices.passed_count, notices.first_passed), (expected, first), "to {target}");
        assert_eq!(advance(&mut simulation, 1).notices, Notices::default(), "it rests there");
    }
}

#[test]
fn steps_that_go_through_a_table_are_taken_again_where_the_scene_asks_for_it() {
    for method in Method::all().into_iter().filter(|method| method.integrator != Integrator::ExplicitEuler) {
        let label = method.name();
        let mut scene = falling(0.1).by(method).certified();
        scene.settings.on_pass = OnPass::Reject;
        let report = advance(&mut scene.simulate(Precision::F64), 1);
        assert_eq!((report.notices.passed_count, report.contact_count > 0), (0, true), "{label}");
        let cause = StepFailure::Passed { particle: 1, collider: "table".to_owned() };
        assert!(!report.rejections.is_empty(), "{label}");
        assert!(report.rejections.iter().all(|it| it.cause == cause), "{label}: {:?}", report.rejections);
    }

    // What no step avoids ends the run.
    let mut scene = falling(0.1).certified();
    (scene.settings.on_pass, scene.network.pins) = (OnPass::Reject, vec![2]);
    let mut simulation = scene.simulate(Precision::F64);
    send(&mut simulation, -0.05);
    let error = try_advance(&mut simulation, 1).expect_err("it goes into the table");
    assert_eq!(error.failure, StepFailure::Passed { particle: 2, collider: "table".to_owned() });
}

#[test]
fn cloth_that_slides_over_a_ball_does_not_go_through_it() {
    let mut network = sheet(14, 0.05, &sheet_rules(100.0, 0.05), 0.005);
    network.pins.clear();
    let mut scene = Scene::new(network, 5e-3).under([0.0, -9.81, 0.0]);
    let ball = Sphere { center: [0.3, -0.25, 0.3], radius: 0.2 };
    scene.colliders = vec![Collider { shape: Shape::Sphere(ball), friction: 0.1, ..table() }];
    let mut simulation = scene.simulate(Precision::F64);
    let mut contacts = 0;
    for step in 0..200 {
        let report = advance(&mut simulation, 1);
        contacts += report.contact_count;
        assert_eq!(report.notices.passed_count, 0, "step {step}");
    }
    assert!(contacts > 1000, "{contacts} contacts");
}

/// A sheet that is squeezed: its tangent is indefinite.
fn squeezed() -> Scene {
    let mut network = sheet(12, 0.05, &sheet_rules(200.0, 0.0), 0.002);
    for (i, x) in network.x.iter_mut().enumerate() {
        *x = [0.7 * x[0], 1e-3 * (1.3 * i as f64).sin(), 0.7 * x[2]];
    }
    Scene::new(network, 0.01)
}

#[test]
fn solves_at_their_cap_are_counted_over_sub_steps_and_fixed_numbers_of_iterations_are_none() {
    let notices = |stop| {
        let mut scene = squeezed();
        scene.settings.solver.stop = stop;
        let report = advance(&mut scene.in_substeps(4).simulate(Precision::F64), 1);
        let solve = report.solve.expect("an implicit step solves");
        assert_eq!(solve.iterations, 12, "of all sub-steps");
        report.notices
    };
    let capped = notices(Stop::Residual { tolerance: 1e-10, max_iterations: 3 });
    assert_eq!(capped, Notices { capped_solves: 4, ..Notices::default() });
    assert_eq!(notices(Stop::Iterations(3)), Notices::default());
}

#[test]
fn a_solve_that_ends_at_its_cap_tells_how_far_it_is_in_metres() {
    let step = |stop: &str| {
        // The patches that `auto` goes on with converge.
        let solver = format!("preconditioner = \"two_level\", {stop}");
        let mut simulation = rippled([75, 65], &format!("unchecked = true\nsolver = {{ {solver} }}"));
        let report = advance(&mut simulation, 1);
        (positions(&simulation), report.cloth.expect("a cloth").error, report.notices.capped_solves)
    };
    let (exact, error, _) = step("tolerance = 1e-9, max_iterations = 10000");
    assert_eq!(error.of_solve, 0.0);
    for cap in [50, 200, 400] {
        let (capped, of_capped, count) = step(&format!("max_iterations = {cap}"));
        let far = max_distance(&exact, &capped);
        let told = of_capped.of_solve;
        assert_eq!(count, 1, "{cap}");
        assert!(0.3 * far < told && told < 10.0 * far, "{cap}: {told} m, and {far} m");
        assert!(of_capped.largest >= told, "{cap}: the estimate of the step counts it");
        assert!(of_capped.rms > 0.99 * error.rms, "{cap}");
    }
    // Cut on purpose.
    assert_eq!(step("fixed_iterations = 50").1.of_solve, 0.0);
}

#[test]
fn the_solve_of_the_sub_step_with_the_largest_residual_is_reported() {
    let residuals = |substeps: u32| {
        let mut scene = squeezed();
        scene.settings.solver.stop = Stop::Iterations(3);
        scene.dt = 0.0025 * f64::from(substeps);
        let mut simulation = scene.in_substeps(substeps).simulate(Precision::F64);
        let solve = |_| advance(&mut simulation, 1).solve.expect("solves").relative_residual;
        (0..4 / substeps).map(solve).collect::<Vec<_>>()
    };
    let largest = residuals(1).into_iter().fold(0.0, f64::max);
    assert_eq!(residuals(4), [largest]);
}

#[test]
fn an_indefinite_matrix_is_counted() {
    let mut scene = squeezed();
    scene.settings.hessian = Hessian::Full;
    let report = advance(&mut scene.simulate(Precision::F64), 1);
    assert_eq!(report.notices, Notices { indefinite_solves: 1, ..Notices::default() });
}
