//! Seams of solids of several parts: cloth that slides over one feels nothing of it, and on it the normal is that of both faces.

use nappe_sim::{
    cloth::{Hessian, Integrator},
    collide::{Collider, Pose, PoseKey, Way},
    math::Precision,
};
use nappe_tests::{
    Method, Scene,
    meshes::{Surface, axes, turned_box12},
    networks::{sheet, sheet_rules},
    scene::{advance, difference, max_distance, norm, positions},
};

use crate::unions::in_two;

const GRAVITY: f64 = 9.81;
const MARGIN: f64 = 0.005;
/// Particles along a side of the sheet, and the length (m) between them.
const SIDE: usize = 5;
const SPACING: f64 = 0.05;
/// How far (m) from the seam its middle begins, and how fast (m/s) it slides there.
const AWAY: f64 = 0.25;
const SPEED: f64 = 1.0;
/// How fast (rad/s) it turns, so that friction has another direction at each particle.
const TURN: f64 = 1.5;
const FRICTION: f64 = 0.1;
/// Steps (s), as many as make 1 s: explicit Euler is stable in them, since they are shorter than damping over stiffness.
const STEP: f64 = 1e-3;
const STEPS: u32 = 1000;
/// The middle and half of the sides (m) of the box that the sheet slides on.
const CENTER: [f64; 3] = [0.0, -0.1, 0.0];
const HALF: [f64; 3] = [0.8, 0.1, 0.6];

/// How the box moves under the sheet.
#[derive(Clone, Copy, Debug)]
enum Moves {
    Not,
    Straight,
    Turning,
}

impl Moves {
    const ALL: [Self; 3] = [Self::Not, Self::Straight, Self::Turning];

    /// A solid that moves so.
    fn collider(self, solid: &Surface) -> Collider {
        let stands = solid.collider(FRICTION, MARGIN);
        match self {
            Self::Not => stands,
            Self::Straight => Collider { velocity: [0.2, 0.1, -0.1], ..stands },
            Self::Turning => {
                let key = |time: f64, position: [f64; 3], angle: f64| {
                    let turn = [0.0, (0.5 * angle).sin(), 0.0, (0.5 * angle).cos()];
                    PoseKey { time, pose: Pose { position, turn } }
                };
                let keys = vec![key(0.0, [0.0; 3], 0.0), key(2.0, [0.1, 0.05, -0.1], 1.2)];
                Collider { way: Some(Way { keys }), ..stands }
            }
        }
    }
}

/// What a sheet does that slides and turns on a box: where it is after 1 s, where it began, and how often particles touched.
fn slides_on(collider: Collider, integrator: Integrator) -> (Vec<[f64; 3]>, Vec<[f64; 3]>, u64) {
    let mut network = sheet(SIDE, SPACING, &sheet_rules(100.0, 0.2), 0.005);
    network.pins.clear();
    let half = 0.5 * SPACING * (SIDE - 1) as f64;
    for (x, v) in network.x.iter_mut().zip(&mut network.v) {
        let [across, along] = [x[0] - half, x[2] - half];
        *x = [across - AWAY, MARGIN, along];
        *v = [SPEED + TURN * along, 0.0, -TURN * across];
    }
    let start = network.x.clone();
    let method = Method::new(integrator, Hessian::Absolute);
    let mut scene = Scene::new(network, STEP).by(method).under([0.0, -GRAVITY, 0.0]);
    scene.colliders = vec![collider];
    let mut simulation = scene.simulate(Precision::F64);
    let mut touched = 0;
    for _ in 0..STEPS {
        let report = advance(&mut simulation, 1);
        touched += report.contact_count;
        let (passed, pinched) = (report.notices.passed_count, report.notices.pinched_count);
        assert_eq!((passed, pinched), (0, 0), "passed, and pinched");
    }
    (positions(&simulation), start, touched)
}

#[test]
fn friction_along_the_seam_of_two_parts_is_that_of_the_plain_box() {
    let axes = axes(0.0, 0.0);
    let plain = turned_box12(CENTER, HALF, axes);
    // They overlap in the way of the sheet, or touch there.
    let seams = [[0.45, 0.55], [0.5, 0.5]].map(|shares| in_two(CENTER, HALF, axes, shares));
    for integrator in Integrator::ALL {
        for moves in Moves::ALL {
            let (expected, start, _) = slides_on(moves.collider(&plain), integrator);
            let ways = expected.iter().zip(&start).map(|(end, start)| norm(difference(*end, *start)));
            let longest = ways.fold(0.0, f64::max);
            assert!((0.2..0.9).contains(&longest), "{integrator:?}, {moves:?}: {longest} m with friction");
            let is_over = |(end, start): &(&[f64; 3], &[f64; 3])| end[0] > 0.0 && start[0] < 0.0;
            let over = expected.iter().zip(&start).filter(is_over).count();
            assert!(2 * over > SIDE * SIDE, "{integrator:?}, {moves:?}: {over} particles are over the seam");

            for (seam, solid) in seams.iter().enumerate() {
                let (found, _, touched) = slides_on(moves.collider(solid), integrator);
                let off = max_distance(&found, &expected);
                let label = format!("{integrator:?}, {moves:?}, seam {seam}");
                assert!(off < 1e-9, "{label}: {off:e} m off after 1 s");
                assert!(touched > 1000, "{label}: {touched} contacts");
            }
        }
    }
}

#[test]
fn the_normal_on_a_seam_is_that_of_the_faces_beside_each_other() {
    for axes in [axes(0.0, 0.0), axes(0.35, -0.2)] {
        let solid = in_two([0.0; 3], [0.8, 0.1, 0.6], axes, [0.5, 0.5]).collider(0.0, 0.0);
        let place = |[x, y, z]: [f64; 3]| [0, 1, 2].map(|c| x * axes[0][c] + y * axes[1][c] + z * axes[2][c]);
        for along in [-0.53, -0.31, 0.0, 0.17] {
            for height in [-1e-3, -1e-10, -1e-14, 0.0, 1e-14, 1e-10, 1e-3] {
                for aside in [-1e-11, 0.0, 1e-11] {
                    let p = place([aside, 0.1 + height, along]);
                    let (distance, normal) = solid.distance(p, 0.0);
                    assert!((distance - height).abs() < 1e-12, "at {p:?}: {distance}, not {height}");
                    let off = norm(difference(normal, axes[1]));
                    assert!(off < 1e-7, "at {p:?}: {normal:?} is {off:e} off");
                }
            }
        }
    }
}
