//! Colliders that keys and calls move: what they carry, how they tilt and turn, and what is refused.

use nappe_sim::{
    cloth::{Hessian, Integrator},
    collide::{
        Collider, Contact, Pose, PoseKey, Shape, StartInside, Way,
        shape::{Cuboid, Plane, Sphere},
    },
    linalg::Stop,
    math::Precision,
    world::{Change, ChangeError, ColliderMove, MoveError, MoveKey, Simulation},
};
use nappe_tests::{
    Method, Scene,
    meshes::icosphere,
    networks::{particles, sheet, sheet_rules},
    scene::{advance, difference, max_distance, norm, positions},
};

const GRAVITY: f64 = 9.81;
const MARGIN: f64 = 0.005;
const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn collider(shape: Shape, friction: f64, keys: Vec<PoseKey>) -> Collider {
    Collider {
        name: "table".to_owned(),
        shape,
        velocity: [0.0; 3],
        way: (!keys.is_empty()).then_some(Way { keys }),
        friction,
        restitution: 0.0,
        margin: MARGIN,
        contact: Contact::default(),
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::Warn,
    }
}

/// A table whose top is at y = -[`MARGIN`].
fn table(friction: f64, keys: Vec<PoseKey>) -> Collider {
    let top = Cuboid { center: middle(), half_extent: [2.0, 0.1, 2.0], axes: AXES };
    collider(Shape::Box(top), friction, keys)
}

fn middle() -> [f64; 3] {
    [0.0, -0.1 - MARGIN, 0.0]
}

/// The turn by an angle (rad) about one of the world's axes.
fn about(axis: usize, angle: f64) -> [f64; 4] {
    let mut turn = [0.0, 0.0, 0.0, (0.5 * angle).cos()];
    turn[axis] = (0.5 * angle).sin();
    turn
}

/// Where a point is, as seen from the reference point of a collider that is turned about one of the world's axes.
fn seen(pose: Pose, axis: usize, x: [f64; 3]) -> [f64; 3] {
    let angle = 2.0 * pose.turn[axis].atan2(pose.turn[3]);
    let (sin, cos) = angle.sin_cos();
    let from = difference(x, pose.position);
    let [j, k] = [(axis + 1) % 3, (axis + 2) % 3];
    let mut seen = from;
    (seen[j], seen[k]) = (cos * from[j] + sin * from[k], cos * from[k] - sin * from[j]);
    seen
}

fn euler() -> [Method; 2] {
    [Integrator::ImplicitEuler, Integrator::SymplecticEuler]
        .map(|integrator| Method::new(integrator, Hessian::Absolute))
}

#[test]
fn a_turntable_carries_a_particle_just_while_friction_is_enough() {
    let (friction, radius, dt) = (0.5, 0.4, 1e-4);
    for method in Method::all() {
        for (share, slips) in [(0.99, false), (1.01, true)] {
            let rate = (share * friction * GRAVITY / radius).sqrt();
            // Less than half a turn from key to key.
            let key = |i: i32| {
                let time = 0.25 * f64::from(i);
                PoseKey { time, pose: Pose { position: middle(), turn: about(1, rate * time) } }
            };
            let mut network = particles(&[[0.0, 0.0, radius]], 0.3);
            network.v[0] = [rate * radius, 0.0, 0.0];
            let mut scene = Scene::new(network, dt).by(method).under([0.0, -GRAVITY, 0.0]);
            scene.colliders = vec![table(friction, (0..=2).map(key).collect())];
            let mut simulation = scene.simulate(Precision::F64);
            let start = seen(simulation.collider_pose(0), 1, positions(&simulation)[0]);
            advance(&mut simulation, 5000);
            let end = seen(simulation.collider_pose(0), 1, positions(&simulation)[0]);
            let way = norm(difference(end, start));
            let label = format!("{}, {share} of what friction holds: {way:e} m on the table", method.name());
            if slips {
                // 0.01 mu g t² / 2 is 6 mm.
                assert!(way > 3e-3, "{label}");
            } else {
                // Between hops of methods that hop it goes straight.
                let most = if euler().contains(&method) { 1e-9 } else { 1e-3 };
                assert!(way < most, "{label}");
            }
        }
    }
}

#[test]
fn a_sheet_slides_on_a_table_that_a_call_tilts_just_when_its_slope_exceeds_the_friction() {
    let friction = 0.3;
    for method in euler() {
        // Each turns about a point of its surface: otherwise what lies on it slides when the turn ceases. A plane has it for its
        // reference point; the box goes along a pose per step.
        let top = [0.0, -MARGIN, 0.0];
        let plane = (Shape::Plane(Plane { point: top, normal: AXES[1] }), 0.0, 1);
        let solid = (table(friction, Vec::new()).shape, 0.1, 1000);
        let shares = [(0.99 * friction, false), (1.01 * friction, true)];
        for ((shape, arm, poses), (slope, slides)) in
            [plane, solid].into_iter().flat_map(|solid| shares.map(|share| (solid.clone(), share)))
        {
            let mut network = sheet(6, 0.05, &sheet_rules(100.0, 0.02), 0.01);
            network.pins.clear();
            network.x.iter_mut().for_each(|x| (x[0], x[2]) = (x[0] - 0.125, x[2] - 0.125));
            let mut scene = Scene::new(network, 1e-3).by(method).under([0.0, -GRAVITY, 0.0]);
            let label = format!("{}, slope {slope}, {shape:?}", method.name());
            scene.colliders = vec![collider(shape, friction, Vec::new())];
            let mut simulation = scene.simulate(Precision::F64);
            advance(&mut simulation, 10);
            let seen = |simulation: &Simulation| {
                let pose = simulation.collider_pose(0);
                positions(simulation).into_iter().map(|x| seen(pose, 2, x)).collect::<Vec<_>>()
            };
            let start = seen(&simulation);
            let tilted = |pose: u32| {
                let time = f64::from(pose) / f64::from(poses);
                let angle = f64::atan(slope) * time;
                key(time, [arm * angle.sin(), top[1] - arm * angle.cos(), 0.0], angle)
            };
            let tilt: Vec<MoveKey> = (1..=poses).map(tilted).collect();
            simulation.apply(&[moves(&tilt)]).expect("a table may be tilted");
            advance(&mut simulation, 2000);
            let way = max_distance(&seen(&simulation), &start);
            // It gives way by less than 2 mm when the table begins and ceases to turn; 0.01 mu g t² / 2 is 14 mm.
            assert!(if slides { way > 8e-3 } else { way < 3e-3 }, "{label}: {way:e} m");
        }
    }
}

/// A ball below the middle of a sheet (m).
const CENTER: [f64; 3] = [0.28, -0.21, 0.27];
const RADIUS: f64 = 0.2;

/// A sheet that falls on a ball.
fn on_a_ball(method: Method, ball: Collider) -> Scene {
    let mut network = sheet(12, 0.05, &sheet_rules(50.0, 0.02), 0.01);
    network.pins.clear();
    network.v.fill([0.0, -1.0, 0.0]);
    let mut scene = Scene::new(network, 1e-3).by(method).under([0.0, -GRAVITY, 0.0]);
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-15, max_iterations: 1000 };
    scene.colliders = vec![ball];
    scene
}

fn ball(friction: f64) -> Collider {
    collider(Shape::Sphere(Sphere { center: CENTER, radius: RADIUS }), friction, Vec::new())
}

fn rubbing() -> Collider {
    ball(0.4)
}

#[test]
fn keys_at_constant_speed_are_a_velocity() {
    let velocity = [0.3, 0.1, -0.2];
    // On a ball that has a velocity, what sticks is seen to rest by what rounding leaves of its slip, and so or otherwise.
    let balls =
        [(ball(0.0), 1e-12), (rubbing(), 1e-7), (icosphere(CENTER, RADIUS, 3).collider(0.4, MARGIN), 1e-12)];
    for method in euler() {
        for ((ball, most), substeps) in balls.iter().flat_map(|ball| [(ball, 1), (ball, 3)]) {
            let start = ball.shape.reference();
            let key = |time: f64| {
                let position = [0, 1, 2].map(|c| start[c] + velocity[c] * time);
                PoseKey { time, pose: Pose { position, turn: Pose::NO_TURN } }
            };
            let way = Some(Way { keys: [0.0, 0.07, 1.0].map(key).to_vec() });
            let [mut a, mut b] = [Collider { velocity, ..ball.clone() }, Collider { way, ..ball.clone() }]
                .map(|ball| on_a_ball(method, ball).in_substeps(substeps).simulate(Precision::F64));
            let contacts = (0..150).map(|_| advance(&mut a, 1).contact_count).sum::<u64>();
            advance(&mut b, 150);
            assert!(contacts > 100, "{contacts} contacts");
            let off = max_distance(&positions(&a), &positions(&b));
            assert!(off < *most, "{}, {:?}, {substeps} sub-steps: {off:e} m", method.name(), ball.shape);
        }
    }
}

fn key(time: f64, position: [f64; 3], angle: f64) -> MoveKey {
    MoveKey { time, position: Some(position), turn: Some(about(2, angle)) }
}

fn moves(keys: &[MoveKey]) -> Change {
    Change::Collider(ColliderMove { collider: "table".to_owned(), keys: keys.into() })
}

#[test]
fn a_way_and_its_updates_one_by_one_have_the_same_bits() {
    let [a, b, c] = [[0.28, -0.19, 0.27], [0.3, -0.2, 0.29], [0.25, -0.15, 0.25]];
    let path = moves(&[key(0.02, a, 0.2), key(0.05, b, -0.3), key(0.08, c, 0.1)]);
    let updates = [(0, key(0.02, a, 0.2)), (20, key(0.03, b, -0.3)), (50, key(0.03, c, 0.1))];
    for method in Integrator::ALL.map(|integrator| Method::new(integrator, Hessian::Absolute)) {
        let scene = on_a_ball(method, rubbing()).in_substeps(3);
        let [mut along, mut by_one] = [(); 2].map(|()| scene.simulate(Precision::F64));
        along.apply(std::slice::from_ref(&path)).expect("it may move");
        for step in 0..100 {
            if let Some((_, key)) = updates.iter().find(|(at, _)| *at == step) {
                by_one.apply(&[moves(&[*key])]).expect("it may move");
            }
            advance(&mut along, 1);
            advance(&mut by_one, 1);
            assert_eq!(along.collider_pose(0), by_one.collider_pose(0), "step {step}");
            assert!(positions(&along) == positions(&by_one), "{}, step {step}", method.name());
            if step > 50 {
                assert_eq!(along.state_hash(), by_one.state_hash(), "{}, step {step}", method.name());
            }
        }
        assert_eq!(along.collider_pose(0).position, c, "it has come");
    }
}

#[test]
fn a_call_goes_on_from_where_a_collider_is_and_a_reset_takes_it_back() {
    let velocity = [0.5, 0.0, 0.0];
    let scene = on_a_ball(euler()[0], Collider { velocity, ..rubbing() });
    let mut simulation = scene.simulate(Precision::F64);
    let start = simulation.collider_pose(0).position;
    advance(&mut simulation, 100);
    let there = simulation.collider_pose(0);
    assert!(norm(difference(there.position, [start[0] + 0.05, start[1], start[2]])) < 1e-15);
    let up = MoveKey { time: 0.1, position: Some([start[0], start[1] + 0.05, start[2]]), turn: None };
    simulation.apply(&[moves(&[up])]).expect("it may move");
    assert_eq!(simulation.collider_pose(0), there, "it has not moved yet");
    assert_eq!(simulation.parameters().colliders, [("table".to_owned(), there)]);
    advance(&mut simulation, 50);
    let half = simulation.collider_pose(0).position;
    let expected = [start[0] + 0.025, start[1] + 0.025, start[2]];
    assert!(norm(difference(half, expected)) < 1e-12, "{half:?}, not {expected:?}");
    advance(&mut simulation, 100);
    assert_eq!(Some(simulation.collider_pose(0).position), up.position, "it rests there");
    simulation.apply(&[Change::Reset]).expect("a reset");
    // Time goes on, and so does its constant velocity.
    assert!((simulation.collider_pose(0).position[0] - start[0] - 0.125).abs() < 1e-12);
}

#[test]
fn a_move_that_cannot_be_is_refused_and_nothing_changes() {
    let mut simulation = on_a_ball(euler()[0], rubbing()).simulate(Precision::F64);
    let before = simulation.state_hash();
    let good = key(0.1, [0.0; 3], 0.0);
    let other = ColliderMove { collider: "chair".to_owned(), keys: [good].into() };
    let name = || "table".to_owned();
    let bent = MoveKey { turn: Some([0.0, 0.0, 0.0, 1.5]), ..good };
    for (changes, expected) in [
        (
            vec![Change::Collider(other)],
            MoveError::UnknownCollider { name: "chair".to_owned(), known: name() },
        ),
        (vec![moves(&[good]), moves(&[good])], MoveError::ColliderTwice { name: name() }),
        (vec![moves(&[])], MoveError::EmptyWay { name: name() }),
        (vec![moves(&[good, good])], MoveError::TimesOfWay { name: name(), key: 1, time: 0.1, after: 0.1 }),
        (vec![moves(&[bent])], MoveError::TurnLength { name: name(), key: 0, length: 1.5 }),
    ] {
        let error = simulation.apply(&changes).expect_err("it is refused");
        assert_eq!(error, ChangeError::Collider(expected));
        assert_eq!(simulation.state_hash(), before, "{error}");
    }
    simulation.apply(&[moves(&[good]), Change::Drag(-1.0)]).expect_err("all or none");
    assert_eq!(simulation.state_hash(), before);
    for (bad, named) in [
        (MoveKey { time: -1e-3, ..good }, "duration"),
        (MoveKey { position: Some([0.0, 1.1e6, 0.0]), ..good }, "position"),
        (MoveKey { position: Some([f64::NAN; 3]), ..good }, "position"),
    ] {
        let error = simulation.apply(&[moves(&[bad])]).expect_err("it is refused");
        assert!(matches!(error, ChangeError::OutOfRange { field, .. } if field == named), "{error}");
    }
    let fast = moves(&[good, key(0.101, [100.0, 0.0, 0.0], 0.0)]);
    let error = simulation.apply(&[fast]).expect_err("too fast");
    assert!(matches!(error, ChangeError::Collider(MoveError::SurfaceSpeed { key: 1, .. })), "{error}");
}
