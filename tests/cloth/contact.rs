//! Planes and spheres: no penetration, restitution, friction on an incline, moving colliders.

use nappe_sim::{
    cloth::{Hessian, Integrator},
    collide::{
        Collider, Contact, Shape, StartInside,
        shape::{Cuboid, Plane, Sphere},
    },
    linalg::Stop,
    math::{Precision, Real},
};
use nappe_tests::{
    Method, NEWTON, Scene,
    networks::{particles, sheet, sheet_rules},
    scene::{advance, difference, max_distance, norm, positions, velocities},
};

const GRAVITY: f64 = 9.81;
const MARGIN: f64 = 0.005;

fn collider(shape: Shape) -> Collider {
    Collider {
        name: "collider".to_owned(),
        shape,
        velocity: [0.0; 3],
        way: None,
        friction: 0.0,
        restitution: 0.0,
        margin: MARGIN,
        contact: Contact::default(),
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::Warn,
    }
}

/// A plane through the origin that rises towards -x by `angle` (rad): things slide towards +x.
fn incline(angle: f64, friction: f64) -> Collider {
    let normal = [angle.sin(), angle.cos(), 0.0];
    Collider { friction, ..collider(Shape::Plane(Plane { point: [0.0; 3], normal })) }
}

/// One particle at a height of `height` (m) along the normal of a collider through the origin.
fn above(collider: Collider, height: f64, method: Method, dt: f64) -> Scene {
    let Shape::Plane(Plane { normal, .. }) = collider.shape else { panic!("a plane") };
    let network = particles(&[normal.map(|n| n * (height + collider.margin))], 0.3);
    let mut scene = Scene::new(network, dt).by(method).under([0.0, -GRAVITY, 0.0]);
    scene.colliders = vec![collider];
    scene
}

#[test]
fn no_particle_of_a_cloth_enters_a_sphere_or_a_floor() {
    let (center, radius, floor) = ([0.45, -0.25, 0.45], 0.2, -0.5);
    for method in Method::all() {
        for precision in Precision::ALL {
            let mut network = sheet(10, 0.1, &sheet_rules(100.0, 0.02), 0.01);
            network.pins.clear();
            let mut scene = Scene::new(network, 5e-4).by(method).under([0.0, -GRAVITY, 0.0]);
            scene.settings.solver.stop = Stop::Residual { tolerance: 1e-4, max_iterations: 50 };
            let ground = Shape::Plane(Plane { point: [0.0, floor, 0.0], normal: [0.0, 1.0, 0.0] });
            scene.colliders = vec![
                Collider { friction: 0.3, ..collider(Shape::Sphere(Sphere { center, radius })) },
                Collider { friction: 0.3, ..collider(ground) },
            ];
            let mut simulation = scene.simulate(precision);
            let rounding = match precision {
                Precision::F32 => f32::ROUNDING,
                Precision::F64 => f64::ROUNDING,
            };
            let mut contacts = 0;
            for _ in 0..40 {
                contacts = advance(&mut simulation, 20).contact_count.max(contacts);
                for x in positions(&simulation) {
                    let depth = (radius + MARGIN - norm(difference(x, center))).max(floor + MARGIN - x[1]);
                    assert!(depth < 16.0 * rounding, "{} in {precision}: {depth:e} m inside", method.name());
                }
            }
            assert!(contacts > 5, "{} in {precision}: at most {contacts} contacts", method.name());
        }
    }
}

#[test]
fn a_particle_that_bounces_rises_to_the_square_of_its_restitution() {
    let height = 0.5;
    for method in Method::all() {
        for restitution in [0.0, 0.5, 0.9, 1.0] {
            let dt = 1e-4;
            let floor = Collider { restitution, ..incline(0.0, 0.0) };
            let mut simulation = above(floor, height, method, dt).simulate(Precision::F64);
            let fall = (2.0 * height / GRAVITY).sqrt();
            advance(&mut simulation, (fall / dt) as u64 + 2);
            let mut top = 0.0_f64;

            // The first bounce alone: it lasts e times twice the fall.
            for _ in 0..(2.0 * restitution * fall / dt) as u64 {
                advance(&mut simulation, 1);
                top = top.max(positions(&simulation)[0][1] - MARGIN);
            }

            let expected = restitution * restitution * height;

            // The first step of a method of order 1 or without a past falls farther or less far by v dt.
            let tolerance = (2.0 * GRAVITY * height).sqrt() * dt;
            assert!((top - expected).abs() < tolerance, "{}, e = {restitution}: {top} m", method.name());
        }
    }
}

#[test]
fn a_particle_comes_to_rest_on_the_floor() {
    for method in Method::all() {
        let mut simulation = above(incline(0.0, 0.5), 0.1, method, 1e-3).simulate(Precision::F64);
        advance(&mut simulation, 1000);
        let (x, v) = (positions(&simulation)[0], velocities(&simulation)[0]);

        assert!((x[1] - MARGIN).abs() < 1e-12, "{}: at {x:?} m", method.name());

        // A step may show the velocity of its own gravity before the contact takes it away.
        assert!(norm(v) <= GRAVITY * 1e-3 * 1.001, "{}: {v:?} m/s", method.name());
    }
}

#[test]
fn a_particle_slips_on_an_incline_just_when_its_slope_exceeds_the_friction() {
    for method in Method::all() {
        for friction in [0.2, 0.577] {
            for (slope, slips) in [(0.99 * friction, false), (1.01 * friction, true)] {
                let scene = above(incline(f64::atan(slope), friction), 0.0, method, 1e-3);
                let mut simulation = scene.simulate(Precision::F64);
                let start = positions(&simulation)[0];
                advance(&mut simulation, 1000);
                let way = norm(difference(positions(&simulation)[0], start));
                let label = format!("{}, friction {friction}, slope {slope}", method.name());
                if slips {
                    // 0.01 friction g cos a t² / 2 within a few steps' worth.
                    assert!(way > 5e-3, "{label}: {way:e} m");
                } else {
                    assert!(way < 1e-5, "{label}: {way:e} m");
                }
            }
        }
    }
}

#[test]
fn a_particle_slides_with_the_acceleration_that_friction_leaves() {
    let angle = 0.6_f64;
    for method in Method::all() {
        for friction in [0.0, 0.3] {
            let dt = 1e-4;
            let mut simulation = above(incline(angle, friction), 0.0, method, dt).simulate(Precision::F64);
            advance(&mut simulation, 1000);
            let before = velocities(&simulation)[0];
            advance(&mut simulation, 5000);
            let gained = norm(difference(velocities(&simulation)[0], before)) / 0.5;
            let expected = GRAVITY * (angle.sin() - friction * angle.cos());
            assert!(
                (gained / expected - 1.0).abs() < 1e-3,
                "{}, friction {friction}: {gained} m/s²",
                method.name()
            );
        }
    }
}

#[test]
fn a_thrown_particle_stops_where_friction_has_taken_its_energy() {
    let (speed, friction) = (1.5, 0.4);
    for method in Method::all() {
        let mut scene = above(incline(0.0, friction), 0.0, method, 1e-4);
        scene.network.v[0] = [speed, 0.0, 0.0];
        let mut simulation = scene.simulate(Precision::F64);
        advance(&mut simulation, 10_000);
        let way = positions(&simulation)[0][0];
        let expected = speed * speed / (2.0 * friction * GRAVITY);
        assert!((way / expected - 1.0).abs() < 1e-3, "{}: {way} m, not {expected}", method.name());
        assert!(velocities(&simulation)[0][0].abs() < 1e-12, "{}: at rest", method.name());
    }
}

#[test]
fn a_moving_floor_lifts_and_carries() {
    for method in Method::all() {
        let velocity = [0.5, 0.3, 0.0];
        let floor = Collider { velocity, ..incline(0.0, 0.8) };
        let mut simulation = above(floor, 0.0, method, 1e-3).simulate(Precision::F64);
        advance(&mut simulation, 1000);
        let (x, v) = (positions(&simulation)[0], velocities(&simulation)[0]);
        assert!((x[1] - 0.3 - MARGIN).abs() < 1e-12, "{}: at {x:?} m", method.name());
        assert!((v[0] - 0.5).abs() < 1e-9, "{}: {v:?} m/s", method.name());
    }
}

#[test]
fn a_particle_comes_to_rest_between_colliders_that_overlap() {
    // The groove between two balls, and the corner of a floor and a ball that stands in it.
    let ball = |x: f64, y: f64| collider(Shape::Sphere(Sphere { center: [x, y, 0.0], radius: 0.5 }));
    let floor = collider(Shape::Plane(Plane { point: [0.0; 3], normal: [0.0, 1.0, 0.0] }));
    let reach = 0.5 + MARGIN;
    let groove = [0.0, (reach * reach - 0.09_f64).sqrt(), 0.0];
    let corner = [(reach * reach - (MARGIN + 0.1) * (MARGIN + 0.1)).sqrt(), MARGIN, 0.0];
    let dt = 1e-3;
    // What a step falls by, which the last collider may push into the one before it.
    let pushed = GRAVITY * dt * dt;
    for method in Method::all() {
        for (colliders, start, rest) in [
            (vec![ball(-0.3, 0.0), ball(0.3, 0.0)], [0.05, 0.6, 0.0], groove),
            (vec![ball(0.3, 0.0), ball(-0.3, 0.0)], [0.05, 0.6, 0.0], groove),
            (vec![floor.clone(), ball(0.0, -0.1)], [corner[0] - 0.02, 0.2, 0.0], corner),
            (vec![ball(0.0, -0.1), floor.clone()], [corner[0] - 0.02, 0.2, 0.0], corner),
        ] {
            let mut scene = Scene::new(particles(&[start], 0.1), dt).by(method).under([0.0, -GRAVITY, 0.0]);
            // Gravity leans towards the ball, so that the particle stays in the corner.
            if rest == corner {
                scene.gravity[0] = -0.25 * GRAVITY;
            }
            scene.colliders =
                colliders.into_iter().map(|collider| Collider { friction: 0.3, ..collider }).collect();
            let mut simulation = scene.simulate(Precision::F64);
            for step in 0..2000_u32 {
                advance(&mut simulation, 1);
                let x = positions(&simulation)[0];
                for collider in &scene.colliders {
                    let (distance, _) = collider.distance(x, 0.0);
                    let label = format!("{}, step {step}, {:?}", method.name(), collider.shape);
                    assert!(
                        distance > MARGIN - 4.0 * pushed - 1e-3 * f64::from(u32::from(step < 200)),
                        "{label}: {distance}"
                    );
                }
            }
            let (x, v) = (positions(&simulation)[0], velocities(&simulation)[0]);
            let off = norm(difference(x, rest));
            assert!(off < 10.0 * pushed, "{}: {off:e} m from the groove, at {x:?}", method.name());
            assert!(norm(v) < 10.0 * GRAVITY * dt, "{}: {v:?}", method.name());
        }
    }
}

#[test]
fn a_particle_leaves_a_plane_at_its_restitution_times_the_speed_at_which_it_came() {
    for method in Method::all() {
        for restitution in [0.0, 0.25, 1.0] {
            // No gravity: it comes at 2 m/s, and its first step ends below the plane.
            let mut scene = above(Collider { restitution, ..incline(0.3, 0.0) }, 1e-3, method, 1e-2);
            let Shape::Plane(Plane { normal, .. }) = scene.colliders[0].shape else { panic!("a plane") };
            scene.gravity = [0.0; 3];
            scene.network.v = vec![normal.map(|n| -2.0 * n)];
            let mut simulation = scene.simulate(Precision::F64);
            assert_eq!(advance(&mut simulation, 1).contact_count, 1, "{}", method.name());
            let expected = normal.map(|n| 2.0 * restitution * n);
            let off = norm(difference(velocities(&simulation)[0], expected));
            assert!(off < 1e-12, "{}, {restitution}: {off:e} m/s off", method.name());
        }
    }
}

#[test]
fn a_sheet_of_which_a_corner_lies_on_a_table_keeps_its_order_elsewhere() {
    let side = 14;
    let run = |dt: f64| {
        let mut network = sheet(side, 0.1, &sheet_rules(200.0, 0.02), 0.01);
        let last = network.x.len() - 1;
        let mut scene = Scene::new(network.clone(), dt)
            .under([0.0, -GRAVITY, 0.0])
            .by(Method { minimizer: NEWTON, ..Method::new(Integrator::Bdf2, Hessian::Absolute) });
        // It is held from the first step on, by a table that reaches no other particle.
        let [x, y, z] = std::mem::take(&mut network.x)[last];
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let top = Cuboid { center: [x, y - 0.1 - MARGIN, z], half_extent: [0.04, 0.1, 0.04], axes };
        scene.colliders = vec![collider(Shape::Box(top))];
        let mut simulation = scene.simulate(Precision::F64);
        let (mut touched, mut without_history) = (0, 0);
        for _ in 0..(0.1 / dt).round() as u32 {
            let report = advance(&mut simulation, 1);
            touched += report.contact_count;
            without_history += report.cloth.expect("a cloth").without_history;
        }
        assert!(touched as f64 > 0.04 / dt, "{touched} contacts");
        assert_eq!(without_history, 1, "the first step alone");
        positions(&simulation)
    };
    let reference = run(0.1 / 1024.0);
    // The four rows nearest to the pinned corners.
    let error = |steps: f64| max_distance(&run(0.1 / steps)[..4 * side], &reference[..4 * side]);
    let errors = [16.0, 32.0, 64.0].map(error);
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((1.8..2.3).contains(&order), "order {order}: {errors:?}");
    }
}
