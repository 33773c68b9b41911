//! Creases: what is pressed into the inner edge or corner of one solid lies on each of its faces there, and rests.

use nappe_sim::{
    cloth::{SpringLaw, SpringRules},
    collide::Collider,
    linalg::SolverSettings,
    math::Precision,
};
use nappe_tests::{
    Scene,
    meshes::{Surface, TRAY_HALF, tray},
    networks::{sheet, sheet_rules},
    scene::{advance, difference, max_distance, norm, positions},
};

/// Five times that of the earth (m/s²).
const GRAVITY: f64 = 5.0 * 9.81;
const MARGIN: f64 = 0.002;
const SPACING: f64 = 0.01;
/// Steps of 1 ms: 2 s.
const STEPS: u64 = 2000;
/// Steps at the end in which nothing may move.
const LAST: u64 = 20;
/// Distance (m) below the margin that is rounding.
const ROUNDING: f64 = 1e-9;
/// Distance (m) above the margin at which a particle lies on a face.
const NEAR: f64 = 1e-6;

/// A face of a pit: a point of it (m), and its normal into the air.
type Face = ([f64; 3], [f64; 3]);

/// A sheet that gravity presses into a crease of a tray.
struct Pressed {
    label: String,
    surface: Surface,
    scene: Scene,
    /// The faces that meet in the crease.
    faces: Vec<Face>,
    /// Particles that come to lie on two faces at least, and on all of three.
    on_two: usize,
    on_three: usize,
}

/// A square sheet of `side` particles a row, each put at `place` from the middle of the sheet (m), in a solid under gravity along
/// `way`.
fn pressed(surface: &Surface, side: usize, place: impl Fn(f64, f64) -> [f64; 3], way: [f64; 3]) -> Scene {
    // It folds easily: stiffer springs hold its middle row off the crease.
    let bend = Some(SpringLaw { stiffness: 2.0, damping: 0.02 });
    let rules = SpringRules { bend, ..sheet_rules(100.0, 0.02) };
    let mut network = sheet(side, SPACING, &rules, 2e-5);
    let half = 0.5 * SPACING * (side - 1) as f64;
    network.pins.clear();
    network.drag = 4e-4;
    network.x.iter_mut().for_each(|x| *x = place(x[0] - half, x[2] - half));
    let size = GRAVITY / norm(way);
    let mut scene = Scene::new(network, 1e-3).under(way.map(|c| c * size));
    scene.settings.solver = SolverSettings::default();
    scene.colliders = vec![surface.collider(0.5, MARGIN)];
    scene
}

/// The floor of a tray, and its wall at the end of x, which stands at `angle` (rad) to the floor.
fn floor_and_wall(angle: f64) -> Vec<Face> {
    vec![([0.0; 3], [0.0, 1.0, 0.0]), ([TRAY_HALF, 0.0, 0.0], [-angle.sin(), -angle.cos(), 0.0])]
}

/// Half of the way from the floor to the wall: gravity points against it, into the crease.
fn into_crease(angle: f64) -> [f64; 3] {
    [(0.5 * angle).cos(), -(0.5 * angle).sin(), 0.0]
}

/// A sheet that lies on the floor, and is pressed with its edge into the crease below a wall.
fn laid(degrees: f64, side: usize) -> Pressed {
    let (surface, angle) = (tray(degrees), degrees.to_radians());
    let height = MARGIN + 0.01;
    let half = 0.5 * SPACING * (side - 1) as f64;
    let middle = TRAY_HALF - height / angle.tan() - MARGIN / angle.sin() - 0.01 - half;
    let scene = pressed(&surface, side, |a, c| [middle + a, height, c], into_crease(angle));
    let label = format!("{side} a row, laid at a wall of {degrees} degrees");
    Pressed { label, surface, scene, faces: floor_and_wall(angle), on_two: side, on_three: 0 }
}

/// A sheet that stands across the crease, and is pressed in with its middle row.
fn folded(degrees: f64, side: usize) -> Pressed {
    let (surface, angle) = (tray(degrees), degrees.to_radians());
    let (sin, cos) = (0.5 * angle).sin_cos();
    let half = 0.5 * SPACING * (side - 1) as f64;
    let away = (half + 0.01) * cos / sin + MARGIN / sin;
    let place = |a: f64, c: f64| [TRAY_HALF - away * cos + a * sin, away * sin + a * cos, c];
    let scene = pressed(&surface, side, place, into_crease(angle));
    let label = format!("{side} a row, folded at a wall of {degrees} degrees");
    Pressed { label, surface, scene, faces: floor_and_wall(angle), on_two: side, on_three: 0 }
}

/// A sheet that is pressed into the corner of the floor and two walls.
fn cornered(side: usize) -> Pressed {
    let surface = tray(90.0);
    let half = 0.5 * SPACING * (side - 1) as f64;
    let middle = TRAY_HALF - MARGIN - 0.01 - half;
    let place = |a: f64, c: f64| [middle + a, MARGIN + 0.01, middle + c];
    let scene = pressed(&surface, side, place, [1.0, -1.0, 1.0]);
    let faces = vec![
        ([0.0; 3], [0.0, 1.0, 0.0]),
        ([TRAY_HALF, 0.0, 0.0], [-1.0, 0.0, 0.0]),
        ([0.0, 0.0, TRAY_HALF], [0.0, 0.0, -1.0]),
    ];
    let label = format!("{side} a row, in a corner of three walls");
    Pressed { label, surface, scene, faces, on_two: 2 * side - 1, on_three: 1 }
}

/// Particles that lie on so many of the faces at least.
fn on_faces(x: &[[f64; 3]], faces: &[Face], count: usize) -> usize {
    let height = |x: [f64; 3], (point, normal): &Face| {
        let out = difference(x, *point);
        out[0] * normal[0] + out[1] * normal[1] + out[2] * normal[2]
    };
    let lies_on = |x: &[f64; 3]| faces.iter().filter(|face| height(*x, face) < MARGIN + NEAR).count();
    x.iter().filter(|x| lies_on(x) >= count).count()
}

/// The particle that is deepest below the margin, and by how much (m).
fn deepest(x: &[[f64; 3]], distance: impl Fn([f64; 3]) -> f64) -> (usize, f64) {
    let depths = x.iter().map(|x| MARGIN - distance(*x)).enumerate();
    depths.fold((0, f64::NEG_INFINITY), |most, one| if one.1 > most.1 { one } else { most })
}

fn rests_in_its_crease(pressed: &Pressed) {
    let Pressed { label, surface, scene, faces, on_two, on_three } = pressed;
    let solid: &Collider = &scene.colliders[0];
    let mut simulation = scene.simulate(Precision::F64);
    let mut before = positions(&simulation);
    for step in 1..=STEPS {
        let notices = advance(&mut simulation, 1).notices;
        let (pinched, passed) = (notices.pinched_count, notices.passed_count);
        assert_eq!(pinched, 0, "{label}, step {step}: pinched, first {:?}", notices.first_pinched);
        assert_eq!(passed, 0, "{label}, step {step}: passed, first {:?}", notices.first_passed);
        if step + LAST < STEPS {
            continue;
        }
        let x = positions(&simulation);
        if step + LAST > STEPS {
            let moved = max_distance(&before, &x);
            assert!(moved < 1e-6, "{label}, step {step}: a particle moves by {moved:e} m");
        }
        let (particle, depth) = deepest(&x, |x| solid.distance(x, 0.0).0);
        assert!(depth < ROUNDING, "{label}, step {step}: particle {particle} is {depth:e} m too deep");
        before = x;
    }
    let (particle, depth) = deepest(&before, |x| surface.distance(x));
    assert!(depth < ROUNDING, "{label}: particle {particle} is {depth:e} m too deep by all triangles");
    for (count, expected) in [(2, *on_two), (3, *on_three)] {
        let found = on_faces(&before, faces, count);
        assert!(found >= expected, "{label}: {found} particles lie on {count} faces, not {expected}");
    }
}

#[test]
fn a_sheet_whose_edge_is_pressed_into_a_crease_rests_on_both_faces() {
    for degrees in [90.0, 60.0, 30.0] {
        for side in [12, 13] {
            rests_in_its_crease(&laid(degrees, side));
        }
    }
}

#[test]
fn a_sheet_that_is_folded_into_a_crease_rests_on_both_faces() {
    for degrees in [30.0, 60.0, 120.0, 150.0] {
        rests_in_its_crease(&folded(degrees, 13));
    }
}

#[test]
fn a_sheet_that_is_pressed_into_a_corner_of_three_walls_rests_on_all_of_them() {
    for side in [12, 13] {
        rests_in_its_crease(&cornered(side));
    }
}
