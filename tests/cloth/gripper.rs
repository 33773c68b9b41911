//! A gripper of two fingers that calls move: it closes on a sheet that lies, lifts it, turns it, and lets it go.

use std::f64::consts::FRAC_PI_2;

use nappe_sim::{
    cloth::{Hessian, Integrator},
    collide::{
        Collider, Contact, Pose, Shape, StartInside,
        shape::{Cuboid, MeshSolid, Plane},
    },
    math::Precision,
    world::{Change, ColliderMove, MoveKey, Simulation},
};
use nappe_tests::{
    Method, Scene,
    meshes::{Surface, box12},
    networks::{particles, sheet, sheet_rules},
    ranks::on_ranks,
    scene::{advance, cross, difference, momenta, norm, positions},
    threads::with_threads,
};

const GRAVITY: f64 = 9.81;
const DT: f64 = 2e-3;
const MARGIN: f64 = 1e-3;
/// Particles a row, and from one to the next (m).
const SIDE: usize = 16;
const SPACING: f64 = 5e-3;
/// Half of the extent (m) of a finger, and the room between two that have closed.
const HALF: [f64; 3] = [0.0225, 0.01, 0.05];
const ROOM: f64 = 1.5 * MARGIN;
/// The middle (m) between the fingers that have closed. The first seven columns of the sheet are between them.
const MIDDLE: [f64; 3] = [0.01, 0.5 * ROOM - MARGIN, 0.0375];
const HELD_COLUMNS: usize = 7;
/// From there to the centre (m) of a finger.
const ARM: f64 = 0.5 * ROOM + HALF[1];
/// Numbers of the fingers in the scene's order; the floor comes first.
const FINGERS: [usize; 2] = [1, 2];
const NAMES: [&str; 2] = ["lower", "upper"];
/// Which way (along y) each is from the middle.
const SIDES: [f64; 2] = [-1.0, 1.0];
/// How far (m) above its place the upper one begins.
const OPEN: f64 = 0.02;
const LIFT: f64 = 0.3;
/// Steps in which it closes, lifts, and turns.
const CLOSING: u64 = 50;
const LIFTING: u64 = 500;
const TURNING: u64 = 500;

fn collider(name: &str, shape: Shape, friction: f64) -> Collider {
    Collider {
        name: name.to_owned(),
        shape,
        velocity: [0.0; 3],
        way: None,
        friction,
        restitution: 0.0,
        margin: MARGIN,
        contact: Contact::default(),
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::default(),
    }
}

/// What a finger is made of.
#[derive(Clone, Copy, Debug)]
enum Made {
    ByFormula,
    OfTriangles,
}

fn finger(center: [f64; 3], made: Made) -> Shape {
    match made {
        Made::ByFormula => {
            let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            Shape::Box(Cuboid { center, half_extent: HALF, axes })
        }
        Made::OfTriangles => {
            let Surface { points, triangles } = box12(center, HALF);
            let solid = MeshSolid::new(points, triangles).unwrap_or_else(|error| panic!("refused: {error}"));
            Shape::Mesh(solid.with_origin(center))
        }
    }
}

/// A place (m) along y from the middle.
fn above(y: f64) -> [f64; 3] {
    [MIDDLE[0], MIDDLE[1] + y, MIDDLE[2]]
}

/// A sheet that lies on the floor and on the lower finger, whose top is level with it.
fn scene(integrator: Integrator, friction: f64, made: Made) -> Scene {
    let mut network = sheet(SIDE, SPACING, &sheet_rules(100.0, 0.005), 2e-5);
    network.pins.clear();
    network.drag = 0.0;
    let method = Method::new(integrator, Hessian::Absolute);
    let mut scene = Scene::new(network, DT).by(method).under([0.0, -GRAVITY, 0.0]).certified();
    scene.settings.block_size = 64;
    let floor = Plane { point: [0.0, -MARGIN, 0.0], normal: [0.0, 1.0, 0.0] };
    scene.colliders = vec![
        collider("floor", Shape::Plane(floor), 0.5),
        collider(NAMES[0], finger(above(-ARM), made), friction),
        collider(NAMES[1], finger(above(ARM + OPEN), made), friction),
    ];
    scene
}

/// Particles that come between the fingers.
fn between(scene: &Scene) -> Vec<usize> {
    let last = (HELD_COLUMNS as f64 - 0.5) * SPACING;
    let held: Vec<usize> = (0..SIDE * SIDE).filter(|i| scene.network.x[*i][0] < last).collect();
    assert_eq!(held.len(), HELD_COLUMNS * SIDE);
    held
}

/// Sends fingers by one call.
fn send(simulation: &mut Simulation, ways: &[(&str, Vec<MoveKey>)]) {
    let change = |(name, keys): &(&str, Vec<MoveKey>)| {
        Change::Collider(ColliderMove { collider: (*name).to_owned(), keys: keys.as_slice().into() })
    };
    let changes: Vec<Change> = ways.iter().map(change).collect();
    simulation.apply(&changes).unwrap_or_else(|error| panic!("refused: {error}"));
}

/// A key at a whole number of steps after the call.
fn key(steps: u64, position: [f64; 3], turn: Option<[f64; 4]>) -> MoveKey {
    MoveKey { time: steps as f64 * DT, position: Some(position), turn }
}

/// Sends both fingers so that the middle between them is at a place (m) and turned by an angle (rad) about z after each of those
/// numbers of steps, and each finger so far (m) from it.
fn carry(simulation: &mut Simulation, stations: &[(u64, [f64; 3], f64, f64)]) {
    let way = |side: f64| {
        let station = |(steps, middle, angle, arm): &(u64, [f64; 3], f64, f64)| {
            let ((sin, cos), (half_sin, half_cos)) = (angle.sin_cos(), (0.5 * angle).sin_cos());
            let out = side * arm;
            let place = [middle[0] - sin * out, middle[1] + cos * out, middle[2]];
            key(*steps, place, Some([0.0, 0.0, half_sin, half_cos]))
        };
        stations.iter().map(station).collect::<Vec<_>>()
    };
    let ways = [0, 1].map(|finger| (NAMES[finger], way(SIDES[finger])));
    send(simulation, &ways);
}

/// Lets the upper finger close on the sheet.
fn closed(scene: &Scene) -> Simulation {
    let mut simulation = scene.simulate(Precision::F64);
    close(&mut simulation);
    simulation
}

fn close(simulation: &mut Simulation) {
    send(simulation, &[(NAMES[1], vec![key(CLOSING, above(ARM), None)])]);
    advance(simulation, CLOSING);
}

fn lift(simulation: &mut Simulation) {
    carry(simulation, &[(LIFTING, above(LIFT), 0.0, ARM)]);
}

/// Turns by 90 degrees, so that what was to the right hangs below: a pose per step.
fn turn(simulation: &mut Simulation) {
    let angle = |step: u64| -FRAC_PI_2 * step as f64 / TURNING as f64;
    let stations: Vec<_> = (1..=TURNING).map(|step| (step, above(LIFT), angle(step), ARM)).collect();
    carry(simulation, &stations);
}

/// A place (m) as a collider sees it.
fn seen(Pose { position, turn: [x, y, z, w] }: Pose, place: [f64; 3]) -> [f64; 3] {
    let (axis, out) = ([-x, -y, -z], difference(place, position));
    let across = cross(axis, out).map(|c| 2.0 * c);
    let inward = cross(axis, across);
    [0, 1, 2].map(|c| out[c] + w * across[c] + inward[c])
}

/// Where each finger sees those particles (m).
fn seen_by_fingers(simulation: &Simulation, particles: &[usize]) -> [Vec<[f64; 3]>; 2] {
    let x = positions(simulation);
    FINGERS.map(|finger| {
        let pose = simulation.collider_pose(finger);
        particles.iter().map(|particle| seen(pose, x[*particle])).collect()
    })
}

/// Takes steps in which those particles stay where the fingers see them, and gravity and loads make all the change of the
/// momentum.
fn steps_with(
    simulation: &mut Simulation,
    (held, masses): (&[usize], &[f64]),
    places: &[Vec<[f64; 3]>; 2],
    steps: u64,
    label: &str,
) {
    let weight = masses.iter().sum::<f64>() * GRAVITY;
    let mut before = momenta(simulation, masses).0;
    for step in 1..=steps {
        let loads = advance(simulation, 1).loads;
        let after = momenta(simulation, masses).0;
        let felt = [0, 1, 2].map(|c| loads.iter().map(|load| load.force[c]).sum::<f64>());
        let gained = [-felt[0], -weight - felt[1], -felt[2]].map(|force| force * DT);
        let off = norm(difference(difference(after, before), gained)) / (weight * DT);
        assert!(off < 1e-10, "{label}, step {step}: off by {off:e} of m g dt");
        let [below, above] = FINGERS.map(|finger| loads[finger].contacts);
        assert!(below.min(above) >= held.len() as u64, "{label}, step {step}: {loads:?}");
        before = after;
        let now = seen_by_fingers(simulation, held);
        for (finger, (before, now)) in places.iter().zip(&now).enumerate() {
            for (particle, (before, now)) in held.iter().zip(before.iter().zip(now)) {
                let off = norm(difference(*before, *now));
                assert!(off < 1e-6, "{label}, step {step}, {particle} at {}: {off:e} m", NAMES[finger]);
            }
        }
    }
}

/// Opens, and takes steps in which gravity alone changes the momentum of the sheet.
fn falls(simulation: &mut Simulation, masses: &[f64], label: &str) {
    carry(simulation, &[(50, above(LIFT), -FRAC_PI_2, ARM + 0.05)]);
    advance(simulation, 1);
    let weight = masses.iter().sum::<f64>() * GRAVITY * DT;
    let mut before = momenta(simulation, masses).0;
    for step in 2..=20 {
        let report = advance(simulation, 1);
        assert_eq!(report.contact_count, 0, "{label}, step {step} after it opened");
        let after = momenta(simulation, masses).0;
        let off = norm(difference(difference(after, before), [0.0, -weight, 0.0]));
        assert!(off < 1e-8 * weight, "{label}, step {step} after it opened: {off:e} N s of {weight:e}");
        before = after;
    }
}

#[test]
fn a_gripper_closes_on_a_sheet_lifts_it_turns_it_and_lets_it_go() {
    for (integrator, made) in [
        (Integrator::ImplicitEuler, Made::ByFormula),
        (Integrator::ImplicitEuler, Made::OfTriangles),
        (Integrator::Bdf2, Made::ByFormula),
        (Integrator::SymplecticEuler, Made::ByFormula),
    ] {
        let label = format!("{integrator:?}, fingers {made:?}");
        let scene = scene(integrator, 0.3, made);
        let held = between(&scene);
        let mut simulation = closed(&scene);
        let x = positions(&simulation);
        for particle in &held {
            let off = (x[*particle][1] - MIDDLE[1]).abs();
            assert!(off < 1e-12, "{label}: {particle} is {off:e} m beside the middle");
        }
        let places = seen_by_fingers(&simulation, &held);
        lift(&mut simulation);
        let who = (&held[..], &scene.network.masses[..]);
        steps_with(&mut simulation, who, &places, LIFTING, &format!("{label}, lifted"));
        turn(&mut simulation);
        steps_with(&mut simulation, who, &places, TURNING, &format!("{label}, turned"));
        for (finger, side) in FINGERS.into_iter().zip(SIDES) {
            let middle = above(LIFT);
            let place = [middle[0] + side * ARM, middle[1], middle[2]];
            let off = norm(difference(simulation.collider_pose(finger).position, place));
            assert!(off < 1e-12, "{label}: a finger is {off:e} m beside its place");
        }
        falls(&mut simulation, &scene.network.masses, &label);
    }
}

#[test]
fn each_finger_feels_half_of_a_particle_that_they_hold() {
    for integrator in [Integrator::ImplicitEuler, Integrator::SymplecticEuler] {
        let mut scene = scene(integrator, 0.3, Made::ByFormula);
        scene.network = particles(&[[MIDDLE[0], 0.0, MIDDLE[2]]], 0.2);
        let mut simulation = closed(&scene);
        lift(&mut simulation);
        // In the first it is brought to the speed of the fingers.
        advance(&mut simulation, 1);
        let half = 0.5 * 0.2 * GRAVITY;
        for step in 2..=LIFTING {
            let loads = advance(&mut simulation, 1).loads;
            for load in FINGERS.map(|finger| loads[finger]) {
                let off = norm(difference(load.force, [0.0, -half, 0.0]));
                assert!(off < 1e-9 * half && load.contacts == 1, "{integrator:?}, step {step}: {load:?}");
                // It is above and below the middles of the fingers.
                assert!(norm(load.torque) < 1e-9 * half, "{integrator:?}, step {step}: {load:?}");
            }
            assert_eq!(loads[0].contacts, 0, "{integrator:?}, step {step}: the floor");
        }
    }
}

#[test]
fn a_gripper_without_friction_loses_the_sheet() {
    let scene = scene(Integrator::ImplicitEuler, 0.0, Made::ByFormula);
    let held = between(&scene);
    let mut simulation = closed(&scene);
    lift(&mut simulation);
    advance(&mut simulation, LIFTING);
    turn(&mut simulation);
    advance(&mut simulation, TURNING + 150);
    let below = above(LIFT)[1] - HALF[0];
    let x = positions(&simulation);
    for particle in held {
        let y = x[particle][1];
        assert!(y < below, "particle {particle} is at {y} m, not below the fingers at {below} m");
    }
}

#[test]
fn what_a_gripper_holds_has_the_same_bits_for_1_to_4_threads() {
    for made in [Made::ByFormula, Made::OfTriangles] {
        let scene = scene(Integrator::ImplicitEuler, 0.3, made);
        let hash = |threads: usize| {
            with_threads(threads, || {
                let mut simulation = closed(&scene);
                lift(&mut simulation);
                assert!(advance(&mut simulation, 50).contact_count >= (HELD_COLUMNS * SIDE) as u64);
                simulation.state_hash()
            })
        };
        let alone = hash(1);
        for threads in 2..=4 {
            assert_eq!(hash(threads), alone, "{threads} threads, fingers {made:?}");
        }
    }
}

#[test]
fn what_a_gripper_holds_has_the_same_bits_over_1_to_3_ranks() {
    let scene = scene(Integrator::ImplicitEuler, 0.3, Made::ByFormula);
    let setup = scene.setup();
    let lifted = |simulation: &mut Simulation| {
        close(simulation);
        lift(simulation);
        let loads = advance(simulation, 50).loads.to_vec();
        let held = FINGERS.map(|finger| loads[finger].contacts);
        assert!(held.iter().all(|contacts| *contacts >= (HELD_COLUMNS * SIDE) as u64), "{loads:?}");
        let (mut whole, _) = Simulation::new(&setup, Precision::F64).expect("the scene is accepted");
        whole.put(&simulation.take());
        (loads, whole.state_hash())
    };
    let alone = lifted(&mut scene.simulate(Precision::F64));
    for size in 1..=3 {
        let over = on_ranks(size, 1, |ranks| {
            let (mut simulation, _) =
                Simulation::over(&setup, Precision::F64, ranks).expect("the scene is accepted");
            lifted(&mut simulation)
        });
        assert!(over.iter().all(|((loads, _), _)| *loads == alone.0), "{size} ranks: loads");
        assert_eq!(over[0].0.1, alone.1, "{size} ranks");
    }
}
