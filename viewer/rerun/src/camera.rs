//! Where the camera stands: on the side of the scene from which solids hide the bodies least.
//!
//! Enters: the bounds of the scene and of its bodies (m), colliders. Leaves: the camera's position and target (m).

use nappe_client::Shape;

use crate::{
    collider::{ColliderView, narrow},
    geometry::{Bounds, along, dot, length, minus},
};

/// From the centre of the scene to the camera, over the radius of the scene.
const EYE: [f32; 3] = [0.68, 0.48, 1.28];
/// Signs along x and z; of sides that hide as little, the first is taken.
const SIDES: [[f32; 2]; 4] = [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]];

/// A camera that sees all of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Camera {
    /// Where it is (m).
    pub(crate) eye: [f32; 3],
    /// What is in the middle of the picture (m).
    pub(crate) target: [f32; 3],
}

impl Camera {
    /// The camera of a scene.
    pub(crate) fn of(scene: &Bounds, bodies: &Bounds, colliders: &[ColliderView]) -> Self {
        let target = scene.center();
        let floor = scene.corners()[0][1];
        // Where bodies are, and where they come to when they fall.
        let seen: Vec<[f32; 3]> =
            bodies.corners().into_iter().flat_map(|at| [at, [at[0], floor, at[2]]]).collect();

        let hidden = |eye: [f32; 3]| {
            seen.iter()
                .filter(|at| colliders.iter().any(|collider| hides(collider.shape(), eye, **at)))
                .count()
        };

        let eyes = SIDES.map(|[x, z]| along(target, scene.radius(), [x * EYE[0], EYE[1], z * EYE[2]]));
        let eye = eyes.into_iter().min_by_key(|eye| hidden(*eye)).unwrap_or(eyes[0]);
        Self { eye, target }
    }
}

/// Balls along the axis of a round solid, to see whether it hides something.
const BALLS: usize = 9;

/// Whether a solid stands between the eye and a point that is not in it. Planes and half-pipes hide nothing:
/// they are drawn only where the eye is on their free side.
fn hides(shape: &Shape, eye: [f32; 3], at: [f32; 3]) -> bool {
    match *shape {
        Shape::Box { center, half_extent, axes, .. } => {
            let axes = axes.map(narrow);
            let local = |point: [f32; 3]| axes.map(|axis| dot(minus(point, narrow(center)), axis));
            crosses(local(eye), local(at), narrow(half_extent))
        }
        Shape::Sphere { center, radius, .. } => meets_ball(eye, at, narrow(center), radius as f32),
        Shape::Capsule { start, end, radius, .. } | Shape::Cylinder { start, end, radius, .. } => {
            let (start, step) = (narrow(start), minus(narrow(end), narrow(start)));
            (0..BALLS).any(|ball| {
                let center = along(start, ball as f32 / (BALLS - 1) as f32, step);
                meets_ball(eye, at, center, radius as f32)
            })
        }
        _ => false,
    }
}

/// Whether a segment goes through the box of a half extent around the origin, and does not end in it.
fn crosses(from: [f32; 3], to: [f32; 3], half: [f32; 3]) -> bool {
    let (mut enter, mut leave) = (0.0_f32, 1.0_f32);
    for axis in 0..3 {
        let step = to[axis] - from[axis];
        let ends = [-half[axis], half[axis]].map(|side| (side - from[axis]) / step);
        // Along the box's side, a segment is within it or not.
        if step == 0.0 {
            leave = if from[axis].abs() < half[axis] { leave } else { -1.0 };
        } else {
            enter = enter.max(ends[0].min(ends[1]));
            leave = leave.min(ends[0].max(ends[1]));
        }
    }
    enter < leave && leave < 1.0
}

/// Whether a segment goes through a ball, and does not end in it.
fn meets_ball(from: [f32; 3], to: [f32; 3], center: [f32; 3], radius: f32) -> bool {
    let (step, toward) = (minus(to, from), minus(center, from));
    let share = (dot(step, toward) / dot(step, step)).clamp(0.0, 1.0);
    let nearest = along(from, share, step);
    length(minus(center, nearest)) < radius && length(minus(center, to)) > radius
}

#[cfg(test)]
mod tests {
    use nappe_client::{Collider, Shape};

    use super::*;

    /// Bodies in a cube of side 1 that stands on the origin, and a scene that is a little larger.
    fn bounds() -> [Bounds; 2] {
        [1.5, 0.5].map(|half| {
            let mut bounds = Bounds::empty();
            bounds.add([-half, 0.0, -half]);
            bounds.add([half, 2.0 * half, half]);
            bounds
        })
    }

    fn side(shape: Shape) -> [bool; 2] {
        let [scene, bodies] = bounds();
        let collider = Collider { name: "it".to_owned(), shape };
        let camera = Camera::of(&scene, &bodies, &[ColliderView::new(&collider, 0)]);
        [camera.eye[0] > 0.0, camera.eye[2] > 0.0]
    }

    #[test]
    fn a_wall_stands_behind_the_bodies() {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let wall = |center: [f64; 3], half_extent: [f64; 3]| Shape::Box {
            center,
            half_extent,
            axes,
            velocity: [0.0; 3],
        };
        assert_eq!(side(wall([0.7, 1.0, 0.0], [0.1, 1.0, 2.0])), [false, true]);
        assert_eq!(side(wall([-0.7, 1.0, 0.0], [0.1, 1.0, 2.0])), [true, true]);
        assert_eq!(side(wall([0.0, 1.0, 0.7], [2.0, 1.0, 0.1])), [true, false]);
    }

    #[test]
    fn what_hides_nothing_or_all_sides_alike_changes_nothing() {
        let ball = |center: [f64; 3], radius: f64| Shape::Sphere { center, radius, velocity: [0.0; 3] };
        assert_eq!(side(ball([0.0, -3.0, 0.0], 1.0)), [true, true]);
        assert_eq!(side(ball([0.0, 0.5, 0.0], 0.4)), [true, true]);
        // In front, towards the first side.
        assert_ne!(side(ball([0.8, 0.8, 1.3], 0.7)), [true, true]);
    }
}
