//! Snow on solids of triangles: a block slides on a box of 12 triangles as on a plane.

use nappe_sim::{
    collide::{Collider, Contact},
    math::Precision,
    snow::{Kernel, Transfer},
};
use nappe_tests::{
    meshes::{Surface, box12},
    scene::{advance, max_distance},
    snow::{SnowScene, Variant, center, elastic, lattice, object, plane},
};

const GRAVITY: f64 = 9.81;
/// Side of a cell (m).
const H: f64 = 0.1;
/// Speed (m/s) at which the block begins to slide: at rest it would be held while its shear builds up.
const SPEED: f64 = 1.0;

/// A block of 4 x 4 x 4 cells that slides on a collider for 1 s, with gravity inclined by `angle` (rad) against it: where
/// its particles are then (m), and how much farther it went than at its first speed (m).
fn slides_on(collider: Collider, angle: f64) -> (Vec<[f64; 3]>, f64) {
    let x = lattice([0.0; 3], [8; 3], [0.5 * H; 3]);
    let body = object("block", x, (0.5 * H).powi(3), 400.0, elastic(1.4e5, 0.2));
    let variant = Variant { kernel: Kernel::Quadratic, transfer: Transfer::Mls };
    let gravity = [GRAVITY * angle.sin(), -GRAVITY * angle.cos(), 0.0];
    let mut scene = SnowScene::new(vec![body], H, 1e-3).by(variant).under(gravity).grouped(10);
    scene = scene.moving(|_| [SPEED, 0.0, 0.0]);
    scene.colliders = vec![collider];
    let (mut simulation, masses) = (scene.simulate(Precision::F64), scene.masses());
    let before = simulation.snow_particles();
    let notices = advance(&mut simulation, 100).notices;
    assert_eq!(notices.passed_count, 0, "none goes through");
    let after = simulation.snow_particles();
    let middle = |particles: &[_]| center(particles, &masses, |_| true)[0];
    let moved = middle(&after) - middle(&before) - SPEED;
    (after.iter().map(|particle| particle.x).collect(), moved)
}

#[test]
fn a_block_slides_on_a_box_of_triangles_by_coulombs_law_and_as_on_a_plane() {
    for (friction_angle, angle) in [(15.0_f64, 24.0_f64), (20.0, 24.0)] {
        let (friction, angle) = (friction_angle.to_radians().tan(), angle.to_radians());
        let by_formula = plane([0.0; 3], [0.0, 1.0, 0.0], Contact::Separating, friction);
        let by_triangles = box12([2.0, -1.0, 0.0], [12.0, 1.0, 4.0]).collider(friction, 0.0);
        let [(expected, _), (found, moved)] =
            [by_formula, by_triangles].map(|collider| slides_on(collider, angle));
        let off = max_distance(&found, &expected);
        assert!(off < 1e-9, "friction {friction}: {off:e} m from where the plane leaves it");
        let exact = 0.5 * GRAVITY * (angle.sin() - friction * angle.cos());
        let off = moved / exact - 1.0;
        assert!(off.abs() < 5e-3, "friction {friction}: {moved} m in 1 s, not {exact}: {off:e} off");
    }
}

#[test]
fn a_block_slides_over_the_seam_of_a_box_of_two_parts_as_on_a_plane() {
    let (friction, angle) = (20.0_f64.to_radians().tan(), 24.0_f64.to_radians());
    let by_formula = plane([0.0; 3], [0.0, 1.0, 0.0], Contact::Separating, friction);
    let (expected, _) = slides_on(by_formula, angle);
    // They overlap in the way of the block, or touch there.
    for [from, to] in [[0.93, 2.97], [1.03, 1.03]] {
        let piece = |low: f64, high: f64| {
            box12([f64::midpoint(low, high), -1.0, 0.0], [0.5 * (high - low), 1.0, 4.0])
        };
        let whole = Surface::joined(&[piece(-10.0, to), piece(from, 14.0)]);
        let (found, _) = slides_on(whole.collider(friction, 0.0), angle);
        let off = max_distance(&found, &expected);
        assert!(off < 1e-9, "parts from {from} m and to {to} m: {off:e} m from where the plane leaves it");
    }
}
