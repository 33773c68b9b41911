//! Snow at colliders that keys move: a constant speed, a drum that turns, and what bounds the step.

use nappe_sim::{
    collide::{Collider, Contact, Pose, PoseKey, Shape, Way, shape::Cuboid},
    linalg::Stop,
    math::Precision,
    report::BoundKind,
    snow::{Integration, Kernel, Transfer},
    time_step::TimeStep,
};
use nappe_tests::{
    scene::advance,
    snow::{SnowScene, Variant, elastic, lattice, object, plane},
};

const H: f64 = 0.1;
const MLS: Variant = Variant { kernel: Kernel::Quadratic, transfer: Transfer::Mls };

fn block(dt: f64) -> SnowScene {
    let x = lattice([0.0; 3], [8, 6, 8], [0.5 * H; 3]);
    let body = object("block", x, (0.5 * H).powi(3), 400.0, elastic(1.4e5, 0.2));
    SnowScene::new(vec![body], H, dt).by(MLS).under([0.0, -9.81, 0.0])
}

/// The turn by an angle (rad) about y.
fn about_y(angle: f64) -> [f64; 4] {
    [0.0, (0.5 * angle).sin(), 0.0, (0.5 * angle).cos()]
}

fn floor(contact: Contact, friction: f64) -> Collider {
    plane([0.2, 0.0, 0.2], [0.0, 1.0, 0.0], contact, friction)
}

#[test]
fn keys_at_constant_speed_are_a_velocity() {
    let velocity = [0.3, 0.2, -0.1];
    let stop = Stop::Residual { tolerance: 1e-10, max_iterations: 500 };
    for integration in [Integration::Explicit, Integration::SemiImplicit { beta: 1.0, stop }] {
        let run = |keyed: bool| {
            let mut scene = block(1e-3);
            scene.settings.integration = integration;
            let floor = floor(Contact::Separating, 0.4);
            let start = floor.shape.reference();
            let key = |time: f64| {
                let position = [0, 1, 2].map(|c| start[c] + velocity[c] * time);
                PoseKey { time, pose: Pose { position, turn: Pose::NO_TURN } }
            };
            let way = Some(Way { keys: [0.0, 0.05, 1.0].map(key).to_vec() });
            let moved = if keyed { Collider { way, ..floor } } else { Collider { velocity, ..floor } };
            scene.colliders = vec![moved];
            let mut simulation = scene.simulate(Precision::F64);
            advance(&mut simulation, 100);
            simulation.snow_particles()
        };
        let ends = [run(false), run(true)];
        let pairs = ends[0].iter().zip(&ends[1]);
        let off = pairs.flat_map(|(a, b)| [0, 1, 2].map(|c| (a.x[c] - b.x[c]).abs())).fold(0.0, f64::max);
        assert!(off < 1e-9, "{integration:?}: {off:e} m");
    }
}

#[test]
fn snow_that_sticks_to_a_floor_turns_with_it() {
    let rate = 0.5;
    let mut scene = block(1e-3);
    // The turn begins with the snow in it.
    scene = scene.moving(|[x, _, z]| [rate * (z - 0.2), 0.0, -rate * (x - 0.2)]);
    let start = [0.2, 0.0, 0.2];
    let key = |time: f64| PoseKey { time, pose: Pose { position: start, turn: about_y(rate * time) } };
    let way = Some(Way { keys: [0.0, 1.0].map(key).to_vec() });
    scene.colliders = vec![Collider { way, ..floor(Contact::Sticky, 0.0) }];
    let mut simulation = scene.simulate(Precision::F64);
    let before = simulation.snow_particles();
    advance(&mut simulation, 1000);
    let (sin, cos) = rate.sin_cos();
    let mut off = 0.0_f64;
    for (from, to) in before.iter().zip(simulation.snow_particles()).filter(|(from, _)| from.x[1] < 0.5 * H) {
        let [x, _, z] = [from.x[0] - 0.2, 0.0, from.x[2] - 0.2];
        let expected = [0.2 + cos * x + sin * z, 0.2 + cos * z - sin * x];
        off = off.max((to.x[0] - expected[0]).hypot(to.x[2] - expected[1]));
    }
    // It has gone 0.14 m at the corners.
    assert!(off < 0.03, "{off} m off");
}

#[test]
fn the_fastest_point_of_a_collider_among_the_snow_bounds_the_step() {
    let (rate, safety, far) = (100.0, 0.9, 2.0);
    let mut scene = block(1e-5);
    scene.settings.time_step = TimeStep::Certified { safety };
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let arm = Cuboid { center: [-far, -0.6, 0.0], half_extent: [10.0, 0.5, 0.5], axes };
    let key =
        |time: f64| PoseKey { time, pose: Pose { position: [-far, -0.6, 0.0], turn: about_y(rate * time) } };
    let way = Some(Way { keys: [0.0, 0.02].map(key).to_vec() });
    scene.colliders = vec![Collider { shape: Shape::Box(arm), way, ..floor(Contact::Separating, 0.0) }];
    let mut simulation = scene.simulate(Precision::F64);
    let bound = advance(&mut simulation, 1).snow.expect("a report of the snow").bound;
    assert_eq!(bound.kind, BoundKind::ColliderSpeed);
    // Between the farthest particle and the farthest corner of the blocks around the particles.
    let [fastest, slowest] = [far + 0.4, far + 0.4 + 12.0 * H].map(|x| safety * 0.5 * H / (rate * x));
    assert!(bound.dt < fastest && bound.dt > 0.8 * slowest, "{} s: {slowest} s to {fastest} s", bound.dt);
}
