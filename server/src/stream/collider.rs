//! A collider as clients receive it, to be drawn, and where it is.
//!
//! Enters: a collider of the simulation. Leaves: its message; its pose. A new shape of `nappe_sim` needs one
//! arm here and one message in frame.proto.

use nappe_proto::v1::{self, collider_shape::Shape as Message};
use nappe_sim::{
    collide::{
        Collider, Pose, Shape,
        shape::{Capsule, Cuboid, Cylinder, HalfPipe, MeshSolid, Plane, Sphere},
    },
    world::Simulation,
};

use super::packing::packed;

/// The message of a collider.
pub(super) fn collider(collider: &Collider) -> v1::ColliderShape {
    let velocity = Some(collider.velocity.into());
    v1::ColliderShape { name: collider.name.clone(), velocity, shape: Some(shape(collider)) }
}

/// Where the colliders are that keys or calls move.
pub(super) fn poses(simulation: &Simulation) -> Vec<v1::ColliderPose> {
    let moved = simulation.colliders().iter().filter(|collider| collider.way.is_some());
    moved.map(|collider| pose(collider.name.clone(), collider.pose(simulation.time()))).collect()
}

/// The message of a collider's pose.
pub(crate) fn pose(name: String, Pose { position, turn }: Pose) -> v1::ColliderPose {
    v1::ColliderPose { name, position: Some(position.into()), turn: Some(turn.into()) }
}

fn shape(collider: &Collider) -> Message {
    let v = |v: [f64; 3]| Some(v.into());
    match collider.shape {
        Shape::Plane(Plane { point, normal }) => {
            Message::Plane(v1::PlaneShape { point: v(point), normal: v(normal) })
        }
        Shape::Sphere(Sphere { center, radius }) => {
            Message::Sphere(v1::SphereShape { center: v(center), radius })
        }
        Shape::Capsule(Capsule { start, end, radius }) => {
            Message::Capsule(v1::CapsuleShape { start: v(start), end: v(end), radius })
        }
        Shape::Box(Cuboid { center, half_extent, axes: [x, y, _] }) => {
            let (center, half_extent, axis_x, axis_y) = (v(center), v(half_extent), v(x), v(y));
            Message::Box(v1::BoxShape { center, half_extent, axis_x, axis_y })
        }
        Shape::Cylinder(Cylinder { start, end, radius }) => {
            Message::Cylinder(v1::CylinderShape { start: v(start), end: v(end), radius })
        }
        Shape::HalfPipe(HalfPipe { point, axis, up, radius }) => {
            let (point, axis, up) = (v(point), v(axis), v(up));
            Message::HalfPipe(v1::HalfPipeShape { point, axis, up, radius })
        }
        Shape::Mesh(ref mesh) => Message::Mesh(self::mesh(mesh)),
    }
}

fn mesh(mesh: &MeshSolid) -> v1::MeshShape {
    let points_f32 = packed(mesh.points().as_flattened().iter().map(|c| (*c as f32).to_le_bytes()));
    let triangles_u32 = packed(mesh.triangles().as_flattened().iter().map(|i| i.to_le_bytes()));
    v1::MeshShape { points_f32, triangles_u32, origin: Some(mesh.origin().into()) }
}
