//! A collider as clients receive it, to be drawn.
//!
//! Enters: a collider of the simulation. Leaves: its message. A new shape of `nappe_sim` needs one
//! arm here and one message in frame.proto.

use nappe_proto::v1::{self, collider_shape::Shape as Message};
use nappe_sim::collide::{Collider, Shape};

/// The message of a collider.
pub(super) fn collider(collider: &Collider) -> v1::ColliderShape {
    v1::ColliderShape { name: collider.name.clone(), shape: Some(shape(collider)) }
}

fn shape(collider: &Collider) -> Message {
    let velocity = Some(collider.velocity.into());
    match collider.shape {
        Shape::Plane { point, normal } => Message::Plane(v1::PlaneShape {
            point: Some(point.into()),
            normal: Some(normal.into()),
            velocity,
        }),
        Shape::Sphere { center, radius } => {
            Message::Sphere(v1::SphereShape { center: Some(center.into()), radius, velocity })
        }
        Shape::Capsule { start, end, radius } => Message::Capsule(v1::CapsuleShape {
            start: Some(start.into()),
            end: Some(end.into()),
            radius,
            velocity,
        }),
        Shape::Box { center, half_extent, axes: [axis_x, axis_y, _] } => Message::Box(v1::BoxShape {
            center: Some(center.into()),
            half_extent: Some(half_extent.into()),
            axis_x: Some(axis_x.into()),
            axis_y: Some(axis_y.into()),
            velocity,
        }),
        Shape::Cylinder { start, end, radius } => Message::Cylinder(v1::CylinderShape {
            start: Some(start.into()),
            end: Some(end.into()),
            radius,
            velocity,
        }),
        Shape::HalfPipe { point, axis, up, radius } => Message::HalfPipe(v1::HalfPipeShape {
            point: Some(point.into()),
            axis: Some(axis.into()),
            up: Some(up.into()),
            radius,
            velocity,
        }),
    }
}
