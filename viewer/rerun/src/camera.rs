//! Where the camera stands: on the side of the scene from which solids hide the bodies least.
//!
//! Enters: the bounds of the scene and of its bodies (m), colliders. Leaves: the camera's position and target (m).

use crate::{
    collider::ColliderView,
    geometry::{Bounds, along},
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
                .filter(|at| colliders.iter().any(|collider| collider.extent().hides(eye, **at)))
                .count()
        };

        let eyes = SIDES.map(|[x, z]| along(target, scene.radius(), [x * EYE[0], EYE[1], z * EYE[2]]));
        let eye = eyes.into_iter().min_by_key(|eye| hidden(*eye)).unwrap_or(eyes[0]);
        Self { eye, target }
    }
}

#[cfg(test)]
mod tests {
    use nappe_client::{Collider, Shape, v1};

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

    #[allow(clippy::unnecessary_wraps, reason = "as the messages hold it")]
    fn vector([x, y, z]: [f64; 3]) -> Option<v1::Vector3> {
        Some(v1::Vector3 { x, y, z })
    }

    fn side(shape: Shape) -> [bool; 2] {
        let [scene, bodies] = bounds();
        let collider = Collider { name: "it".to_owned(), shape: Some(shape), velocity: [0.0; 3] };
        let camera = Camera::of(&scene, &bodies, &[ColliderView::new(&collider, 0).expect("a known shape")]);
        [camera.eye[0] > 0.0, camera.eye[2] > 0.0]
    }

    #[test]
    fn a_wall_stands_behind_the_bodies() {
        let wall = |center: [f64; 3], half_extent: [f64; 3]| {
            Shape::Box(v1::BoxShape {
                center: vector(center),
                half_extent: vector(half_extent),
                axis_x: vector([1.0, 0.0, 0.0]),
                axis_y: vector([0.0, 1.0, 0.0]),
            })
        };
        assert_eq!(side(wall([0.7, 1.0, 0.0], [0.1, 1.0, 2.0])), [false, true]);
        assert_eq!(side(wall([-0.7, 1.0, 0.0], [0.1, 1.0, 2.0])), [true, true]);
        assert_eq!(side(wall([0.0, 1.0, 0.7], [2.0, 1.0, 0.1])), [true, false]);
    }

    #[test]
    fn what_hides_nothing_or_all_sides_alike_changes_nothing() {
        let ball =
            |center: [f64; 3], radius: f64| Shape::Sphere(v1::SphereShape { center: vector(center), radius });
        assert_eq!(side(ball([0.0, -3.0, 0.0], 1.0)), [true, true]);
        assert_eq!(side(ball([0.0, 0.5, 0.0], 0.4)), [true, true]);
        // In front, towards the first side.
        assert_ne!(side(ball([0.8, 0.8, 1.3], 0.7)), [true, true]);
    }

    #[test]
    fn a_mesh_hides_what_the_ball_in_its_box_does() {
        let (center, radius) = ([0.8_f32, 0.8, 1.3], 0.7_f32);
        let tip = |i: usize| {
            let mut at = center;
            at[i / 2] += if i.is_multiple_of(2) { radius } else { -radius };
            at
        };
        let points = (0..6).flat_map(tip).flat_map(f32::to_le_bytes);
        let triangles =
            [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        let triangles = triangles.into_iter().flatten().flat_map(u32::to_le_bytes);
        let (points_f32, triangles_u32) = (points.collect::<Vec<u8>>(), triangles.collect::<Vec<u8>>());
        let (points_f32, triangles_u32) = (points_f32.into(), triangles_u32.into());
        let mesh = v1::MeshShape { points_f32, triangles_u32, origin: None };
        let ball = v1::SphereShape { center: vector(center.map(f64::from)), radius: f64::from(radius) };
        assert_eq!(side(Shape::Mesh(mesh)), side(Shape::Sphere(ball)));
    }
}
