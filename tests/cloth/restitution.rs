//! Bounces: how high, how long, in which order of the step, and what sheets do that bounce.

use nappe_sim::{
    cloth::Integrator,
    collide::{
        Collider, Contact, Shape, StartInside,
        shape::{Plane, Sphere},
    },
    math::{Precision, Vec3},
};
use nappe_tests::{
    Method, Random, Scene,
    networks::{particles, sheet, sheet_rules, spring},
    scene::{advance, positions, try_advance},
};

use crate::bounces::bounces_fall_by_the_square_of_their_restitution;

const GRAVITY: f64 = 9.81;
const MASS: f64 = 0.02;
const STIFFNESS: f64 = 3.0;

fn ground(shape: Shape, restitution: f64) -> Collider {
    Collider {
        name: "ground".to_owned(),
        shape,
        velocity: [0.0; 3],
        way: None,
        friction: 0.0,
        restitution,
        margin: 0.0,
        contact: Contact::default(),
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::default(),
    }
}

#[test]
fn bounces_fall_by_the_square_of_their_restitution_and_come_to_rest_in_time() {
    for (dt, seconds) in [(0.01, 30.0), (0.005, 8.0), (0.001, 2.0)] {
        bounces_fall_by_the_square_of_their_restitution(dt, seconds);
    }
}

/// Start (m) of a particle on a spring, beside where it is at rest, and place of a wall that it leaves as fast as it came.
const START: f64 = -0.4;
const WALL: f64 = 0.17;

/// The largest error (m) of its place in `time` (s), in steps of `dt` (s).
fn error_against_a_wall(method: Method, dt: f64, time: f64) -> f64 {
    let mut network = particles(&[[START, 0.0, 0.0], [1.0, 0.0, 0.0]], MASS);
    network.springs = vec![spring([0, 1], 1.0, STIFFNESS, 0.0)];
    network.pins = vec![1];
    let mut scene = Scene::new(network, dt).by(method);
    let wall = Shape::Plane(Plane { point: [WALL, 0.0, 0.0], normal: [-1.0, 0.0, 0.0] });
    scene.colliders = vec![ground(wall, 1.0)];
    let mut simulation = scene.simulate(Precision::F64);

    // It swings about the origin, comes to the wall every period, and turns there.
    let omega = (STIFFNESS / MASS).sqrt();
    let period = 2.0 * (WALL / START).acos() / omega;
    let exact = |time: f64| START * (omega * (time - (time / period).round() * period)).cos();
    let mut worst = 0.0_f64;
    for step in 1..=(time / dt).round() as u32 {
        advance(&mut simulation, 1);
        worst = worst.max((positions(&simulation)[0][0] - exact(f64::from(step) * dt)).abs());
    }
    worst
}

#[test]
fn a_bounce_has_the_order_of_its_method() {
    for method in Method::all() {
        if method.integrator == Integrator::ExplicitEuler {
            continue;
        }
        let errors = [500.0, 2000.0, 8000.0].map(|steps| error_against_a_wall(method, 1.25 / steps, 1.25));
        let order = (errors[0] / errors[2]).log2() / 4.0;
        let expected = f64::from(method.integrator.order());
        assert!(order > expected - 0.25, "{}: {order}, {errors:?}", method.name());
    }
}

#[test]
fn what_lands_lies_on_the_surface_at_its_first_contact() {
    for method in Method::all() {
        for (dt, height) in [(0.01, 0.97), (0.01, 0.313), (0.004, 1.7), (0.001, 0.02), (0.02, 3.1)] {
            let mut network = sheet(4, 0.05, &sheet_rules(100.0, 0.02), 0.005);
            network.pins.clear();
            network.x.iter_mut().for_each(|x| x[1] = height);
            let mut scene = Scene::new(network, dt).by(method).under([0.0, -GRAVITY, 0.0]).certified();
            if method.integrator == Integrator::ExplicitEuler {
                // Without damping no step of it is stable.
                scene.network.drag = 0.02;
            }
            let floor = Shape::Plane(Plane { point: [0.0; 3], normal: [0.0, 1.0, 0.0] });
            scene.colliders = vec![ground(floor, 0.0)];
            let mut simulation = scene.simulate(Precision::F64);
            let mut landed = 0;
            for step in 0..(2.0 / dt) as u32 {
                let report = advance(&mut simulation, 1);
                if report.contact_count == 0 && landed == 0 {
                    continue;
                }
                landed += 1;
                for x in positions(&simulation) {
                    let label = format!("{}, dt {dt}, {height} m, step {step}", method.name());
                    assert!(x[1].abs() < 1e-9, "{label}: at {:e} m", x[1]);
                }
                if landed == 20 {
                    break;
                }
            }
            assert_eq!(landed, 20, "{}", method.name());
        }
    }
}

#[test]
fn sheets_that_bounce_keep_near_their_energy_and_take_few_steps_again() {
    let mut random = Random::seeded(49);
    let (mut all_taken, mut all_rejected) = (0, 0);
    // Of random size, way and stiffness, on a table or a ball.
    for number in 0..200 {
        let side = 4 + random.between(0.0, 9.0) as usize;
        let stiffness = random.between(10.0, 300.0);
        let mut network = sheet(side, 0.05, &sheet_rules(stiffness, 0.01), 0.005);
        network.pins.clear();
        let turn = random.rotation();
        let way: [f64; 3] = random.vector();
        for x in &mut network.x {
            let y = turn * Vec3::new(x[0], x[1], x[2]);
            *x = [y.x, y.y + 0.8, y.z];
        }
        network.v.fill([way[0], -2.0 * way[1].abs(), way[2]]);
        let shape = if number % 2 == 0 {
            Shape::Plane(Plane { point: [0.0; 3], normal: [0.0, 1.0, 0.0] })
        } else {
            Shape::Sphere(Sphere { center: [0.0, -0.3, 0.0], radius: 0.5 })
        };
        let methods = Method::all();
        let method = methods[number % methods.len()];
        let dt = random.between(0.001, 0.01);
        let mut scene = Scene::new(network, dt).by(method).under([0.0, -GRAVITY, 0.0]).certified();
        if method.integrator == Integrator::ExplicitEuler {
            scene.network.drag = 0.02;
        }
        let restitution = random.between(0.1, 1.0);
        scene.colliders = vec![Collider { friction: random.between(0.0, 1.0), ..ground(shape, restitution) }];
        let mut simulation = scene.simulate(Precision::F64);
        let label = format!("sheet {number}, {}, dt {dt}, restitution {restitution}", method.name());
        let start = simulation.diagnose().total_energy();
        for step in 0..(1.0 / dt) as u32 {
            let report = try_advance(&mut simulation, 1).unwrap_or_else(|e| panic!("{label}: {e}"));
            if method.integrator.is_implicit() {
                let steps = report.cloth.expect("a cloth");
                (all_taken, all_rejected) = (all_taken + steps.substeps, all_rejected + steps.rejected);
            }
            let energy = report.diagnostics.total_energy();
            // Of what moves a twentieth may be owed for contacts, and each solve has a share of its own.
            assert!(energy < 1.15 * start, "{label}, step {step}: {energy} of {start} J");
        }
    }
    assert!(all_taken > 20_000 && all_rejected <= all_taken / 100, "{all_rejected} of {all_taken} again");
}
