//! Colliders at random, beside what a scene has or below it: of every shape, at rest, on a straight way, on a way of keys.

use nappe_scene::{ColliderKey, ColliderMesh, ColliderText, Mesh, Rotate, ShapeText};
use nappe_sim::{
    collide::{Collider, Contact, StartInside},
    mesh::TriangleMesh,
};

use super::Case;
use crate::Random;

/// Adds a collider to a scene of a size (m), in steps of `dt` (s).
pub(super) fn add(random: &mut Random, case: &mut Case, [size, dt]: [f64; 2], number: usize) {
    let name = format!("c{number}");
    let away = random.direction();
    let radius = size * random.between(0.1, 1.0);
    let center = away.map(|c| (size + radius) * random.between(0.6, 1.1) * c);
    let (shape, reference) = shape(random, case, (&name, away), center, radius);
    let is_still = random.chance(0.4);
    let speed = if is_still { 0.0 } else { random.decades(0.01, 5.0) };
    // Rather towards the scene than away from it.
    let off = random.direction();
    let velocity = [0, 1, 2].map(|c| speed * (0.6 * off[c] - away[c]));
    let keys = if !is_still && random.chance(0.5) {
        way(random, reference, velocity, dt * case.scene.steps as f64)
    } else {
        Vec::new()
    };
    case.scene.colliders.push(ColliderText {
        name,
        shape,
        velocity: if keys.is_empty() { velocity } else { [0.0; 3] },
        friction: if random.chance(0.5) { 0.0 } else { random.between(0.0, 1.0) },
        restitution: if random.chance(0.7) { 0.0 } else { random.between(0.1, 1.0) },
        margin: if random.chance(0.5) { 0.0 } else { 0.02 * size },
        contact: random.pick(&[Contact::Separating, Contact::Separating, Contact::Slip, Contact::Sticky]),
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::Warn,
        keys,
    });
}

/// A shape, and its reference point (m).
fn shape(
    random: &mut Random,
    case: &mut Case,
    (name, away): (&str, [f64; 3]),
    center: [f64; 3],
    radius: f64,
) -> (ShapeText, [f64; 3]) {
    let off = random.direction();
    let [start, end] = [-1.0, 1.0].map(|side: f64| [0, 1, 2].map(|c| center[c] + side * radius * off[c]));
    let shape = match random.whole(0, 6) {
        0 => ShapeText::Plane { point: center, normal: away.map(|c| -c) },
        1 => ShapeText::Sphere { center, radius },
        2 => ShapeText::Capsule { start, end, radius: 0.5 * radius },
        3 => {
            let size = [0; 3].map(|_| radius * random.between(0.5, 2.0));
            let rotate = Rotate { axis: random.direction(), degrees: random.between(-180.0, 180.0) };
            ShapeText::Box { center, size, rotate: Some(rotate) }
        }
        4 => ShapeText::Cylinder { start, end, radius: 0.7 * radius },
        5 => {
            let axis = nappe_sim::math::array::cross(away, off);
            ShapeText::HalfPipe { point: [0.0; 3], axis, up: away.map(|c| -c), radius: 2.0 * radius }
        }
        _ => {
            let file = format!("{name}.ply");
            case.meshes.insert(file.clone(), octahedron(center, radius));
            ShapeText::Mesh(ColliderMesh::new(Mesh::file(file)))
        }
    };
    let reference = match &shape {
        ShapeText::HalfPipe { point, .. } => *point,
        ShapeText::Mesh(_) => [0.0; 3],
        _ => center,
    };
    (shape, reference)
}

/// A closed mesh of eight triangles.
fn octahedron(center: [f64; 3], radius: f64) -> TriangleMesh {
    let corner = |i: usize| {
        let mut at = center;
        at[i / 2] += if i.is_multiple_of(2) { radius } else { -radius };
        at
    };
    let triangles =
        vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    TriangleMesh { points: (0..6).map(corner).collect(), triangles, ..TriangleMesh::default() }
}

/// Keys from a place (m) on, at about a velocity (m/s), for a time (s), with turns.
fn way(random: &mut Random, start: [f64; 3], velocity: [f64; 3], time: f64) -> Vec<ColliderKey> {
    let turns = random.chance(0.6);
    let count = random.whole(2, 4);
    let key = |i: u32, random: &mut Random| {
        let time = time * f64::from(i) / f64::from(count - 1);
        let wobble = if i == 0 { 0.0 } else { random.between(0.7, 1.3) };
        let position = [0, 1, 2].map(|c| start[c] + wobble * velocity[c] * time);
        let off = random.vector().map(|c| if turns && i > 0 { 0.3 * c } else { 0.0 });
        ColliderKey { time, position, turn: [off[0], off[1], off[2], 1.0] }
    };
    (0..count).map(|i| key(i, random)).collect()
}
