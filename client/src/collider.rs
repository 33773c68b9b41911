//! Colliders: closed shapes, to be drawn.
//!
//! Enters: `v1::ColliderShape`, from the wire. Leaves: [`Collider`], whose numbers are finite, whose lengths
//! are positive and whose directions are of length 1.

use nappe_proto::v1;

/// How far a direction's length may be from 1, and the cosine of two at right angles from 0: the rounding of
/// binary32.
const UNIT_TOLERANCE: f64 = 1e-5;

/// A shape that particles collide with.
#[derive(Debug, Clone, PartialEq)]
pub struct Collider {
    /// Its name in the scene.
    pub name: String,
    /// The shape.
    pub shape: Shape,
}

/// The shape of a collider, at time 0.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Shape {
    /// The half-space below a plane.
    Plane {
        /// A point of the plane (m).
        point: [f64; 3],
        /// Unit normal, towards the free side.
        normal: [f64; 3],
        /// Velocity (m/s).
        velocity: [f64; 3],
    },
    /// A ball.
    Sphere {
        /// Centre (m).
        center: [f64; 3],
        /// Radius (m).
        radius: f64,
        /// Velocity (m/s).
        velocity: [f64; 3],
    },
    /// All points within `radius` of a segment.
    Capsule {
        /// One end of the segment (m).
        start: [f64; 3],
        /// The other end (m).
        end: [f64; 3],
        /// Radius (m).
        radius: f64,
        /// Velocity (m/s).
        velocity: [f64; 3],
    },
    /// A box.
    Box {
        /// Centre (m).
        center: [f64; 3],
        /// Half of its extent along its own axes (m).
        half_extent: [f64; 3],
        /// Its own axes in the world: orthonormal, right-handed, one a row.
        axes: [[f64; 3]; 3],
        /// Velocity (m/s).
        velocity: [f64; 3],
    },
    /// A solid cylinder with flat ends.
    Cylinder {
        /// Centre of one end (m).
        start: [f64; 3],
        /// Centre of the other end (m).
        end: [f64; 3],
        /// Radius (m).
        radius: f64,
        /// Velocity (m/s).
        velocity: [f64; 3],
    },
    /// The ground below a trough: outside of a tube, below its axis; endless along the axis.
    HalfPipe {
        /// A point of the tube's axis (m).
        point: [f64; 3],
        /// Unit direction of the axis.
        axis: [f64; 3],
        /// Unit direction of the opening, at right angles to the axis.
        up: [f64; 3],
        /// Inner radius (m).
        radius: f64,
        /// Velocity (m/s).
        velocity: [f64; 3],
    },
    /// A shape that this client is too old to know.
    Unknown,
}

impl Shape {
    /// Velocity (m/s).
    pub const fn velocity(&self) -> [f64; 3] {
        match *self {
            Self::Plane { velocity, .. }
            | Self::Sphere { velocity, .. }
            | Self::Capsule { velocity, .. }
            | Self::Box { velocity, .. }
            | Self::Cylinder { velocity, .. }
            | Self::HalfPipe { velocity, .. } => velocity,
            Self::Unknown => [0.0; 3],
        }
    }
}

impl Collider {
    /// Reads the message and checks its numbers; an error is the collider's name and what is wrong.
    pub(crate) fn from_wire(wire: v1::ColliderShape) -> Result<Self, (String, &'static str)> {
        use v1::collider_shape::Shape as Wire;
        let shape = match wire.shape {
            None => Ok(Shape::Unknown),
            Some(Wire::Plane(plane)) => plane_from(plane),
            Some(Wire::Sphere(sphere)) => sphere_from(sphere),
            Some(Wire::Capsule(capsule)) => capsule_from(capsule),
            Some(Wire::Box(shape)) => box_from(shape),
            Some(Wire::Cylinder(cylinder)) => cylinder_from(cylinder),
            Some(Wire::HalfPipe(half_pipe)) => half_pipe_from(half_pipe),
        };
        match shape {
            Ok(shape) => Ok(Self { name: wire.name, shape }),
            Err(what) => Err((wire.name, what)),
        }
    }
}

fn plane_from(wire: v1::PlaneShape) -> Result<Shape, &'static str> {
    let normal = unit(wire.normal, "its normal is not of length 1")?;
    Ok(Shape::Plane { point: finite(wire.point)?, normal, velocity: finite(wire.velocity)? })
}

fn sphere_from(wire: v1::SphereShape) -> Result<Shape, &'static str> {
    let radius = positive(wire.radius)?;
    Ok(Shape::Sphere { center: finite(wire.center)?, radius, velocity: finite(wire.velocity)? })
}

fn capsule_from(wire: v1::CapsuleShape) -> Result<Shape, &'static str> {
    let radius = positive(wire.radius)?;
    let (start, end) = (finite(wire.start)?, finite(wire.end)?);
    Ok(Shape::Capsule { start, end, radius, velocity: finite(wire.velocity)? })
}

fn box_from(wire: v1::BoxShape) -> Result<Shape, &'static str> {
    let half_extent = finite(wire.half_extent)?;
    if half_extent.iter().any(|&half| half <= 0.0) {
        return Err("half of its extent is not positive along each axis");
    }
    let x = unit(wire.axis_x, "its first axis is not of length 1")?;
    let y = unit(wire.axis_y, "its second axis is not of length 1")?;
    if dot(x, y).abs() > UNIT_TOLERANCE {
        return Err("its axes are not at right angles");
    }
    let axes = [x, y, cross(x, y)];
    Ok(Shape::Box { center: finite(wire.center)?, half_extent, axes, velocity: finite(wire.velocity)? })
}

fn cylinder_from(wire: v1::CylinderShape) -> Result<Shape, &'static str> {
    let radius = positive(wire.radius)?;
    let (start, end) = (finite(wire.start)?, finite(wire.end)?);
    if start == end {
        return Err("its two ends are one point");
    }
    Ok(Shape::Cylinder { start, end, radius, velocity: finite(wire.velocity)? })
}

fn half_pipe_from(wire: v1::HalfPipeShape) -> Result<Shape, &'static str> {
    let radius = positive(wire.radius)?;
    let axis = unit(wire.axis, "its axis is not of length 1")?;
    let up = unit(wire.up, "the direction of its opening is not of length 1")?;
    if dot(axis, up).abs() > UNIT_TOLERANCE {
        return Err("its opening is not at right angles to its axis");
    }
    let (point, velocity) = (finite(wire.point)?, finite(wire.velocity)?);
    Ok(Shape::HalfPipe { point, axis, up, radius, velocity })
}

fn positive(radius: f64) -> Result<f64, &'static str> {
    if radius.is_finite() && radius > 0.0 { Ok(radius) } else { Err("its radius is not a positive number") }
}

/// Three finite numbers; an absent vector is zero, as everywhere in proto3.
fn finite(wire: Option<v1::Vector3>) -> Result<[f64; 3], &'static str> {
    let v = wire.map_or([0.0; 3], |v| [v.x, v.y, v.z]);
    if v.iter().all(|value| value.is_finite()) { Ok(v) } else { Err("a coordinate is not finite") }
}

/// A direction of length 1, up to rounding.
fn unit(wire: Option<v1::Vector3>, message: &'static str) -> Result<[f64; 3], &'static str> {
    let v = finite(wire)?;
    if (dot(v, v).sqrt() - 1.0).abs() > UNIT_TOLERANCE { Err(message) } else { Ok(v) }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
