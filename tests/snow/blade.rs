//! Snow that a thin blade goes through: its particles are counted as those of cloth are.

use nappe_sim::{
    collide::{Collider, Contact, Shape, shape::Cuboid},
    math::Precision,
    report::Notices,
};
use nappe_tests::{
    scene::advance,
    snow::{SnowScene, elastic, lattice, object, plane},
};

const H: f64 = 0.05;

/// Ten layers of a hundred particles, 25 mm apart, and a blade 2 mm thick whose middle is at x = -17 mm, in steps of 1 ms:
/// at 10 m/s it jumps over every other layer, and ends with its back in the others. No node is ever in it.
fn scene(speed: f64) -> SnowScene {
    let x = lattice([0.0; 3], [10; 3], [0.5 * H; 3]);
    let body = object("block", x, (0.5 * H).powi(3), 400.0, elastic(1e4, 0.2));
    let mut scene = SnowScene::new(vec![body], H, 1e-3);
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let blade = Cuboid { center: [-0.017, 0.125, 0.125], half_extent: [1e-3, 2.0, 2.0], axes };
    scene.colliders = vec![Collider {
        shape: Shape::from(blade),
        velocity: [speed, 0.0, 0.0],
        ..plane([0.0; 3], [0.0, 1.0, 0.0], Contact::Separating, 0.0)
    }];
    scene
}

#[test]
fn particles_of_snow_that_a_blade_goes_through_are_counted_once_and_the_first_is_named() {
    for precision in Precision::ALL {
        let mut simulation = scene(10.0).simulate(precision);
        let notices = (0..40).map(|_| advance(&mut simulation, 1).notices);
        let told: Vec<Notices> = notices.filter(|notices| *notices != Notices::default()).collect();
        let layer = |first| Notices { passed_count: 100, first_passed: Some(first), ..Notices::default() };
        let layers: Vec<Notices> = (0..10).map(|k| layer(100 * k)).collect();
        assert_eq!(told, layers, "{precision}");
    }
}

#[test]
fn snow_that_a_thick_plate_pushes_does_not_count_as_passed() {
    let mut thick = scene(1.0);
    let Shape::Box(plate) = &mut thick.colliders[0].shape else { panic!("a box") };
    (plate.center[0], plate.half_extent[0]) = (-0.516, 0.5);
    let mut simulation = thick.simulate(Precision::F64);
    for step in 0..60 {
        assert_eq!(advance(&mut simulation, 1).notices, Notices::default(), "step {step}");
    }

    let first = simulation.snow_particles()[0].x[0];
    assert!(first > 0.03, "it was pushed, to {first} m");
}
