//! Colliders: the contract's own shapes, checked so that they can be drawn.
//!
//! Enters: `v1::ColliderShape`, from the wire. Leaves: [`Collider`], whose shape has finite numbers, lengths
//! above 0, and directions of length 1 that are at right angles where they must be; triangles name points that are there.

use std::collections::HashSet;

use nappe_proto::v1;

use crate::collider_mesh;

pub use v1::collider_shape::Shape;

/// How far a direction's length may be from 1, and the cosine of two at right angles from 0: the rounding of
/// binary32.
const UNIT_TOLERANCE: f64 = 1e-5;

/// A shape that particles collide with.
#[derive(Debug, Clone, PartialEq)]
pub struct Collider {
    /// Its name in the scene.
    pub name: String,
    /// Its shape at time 0, as the contract describes it; none: one that this client is too old to know.
    pub shape: Option<Shape>,
    /// Its velocity (m/s), the same at all times; frames that have a pose of it say more.
    pub velocity: [f64; 3],
}

/// The colliders of a whole topology; an error is the name of the first that is wrong, and what is.
pub(crate) fn read(wire: Vec<v1::ColliderShape>) -> Result<Vec<Collider>, (String, &'static str)> {
    let mut meshes = HashSet::new();
    let mut colliders = Vec::with_capacity(wire.len());
    for collider in wire {
        let collider = Collider::from_wire(collider)?;
        // Parts that followed each other are one by now.
        if matches!(collider.shape, Some(Shape::Mesh(_))) && !meshes.insert(collider.name.clone()) {
            return Err((collider.name, "its arrays go on behind another collider"));
        }
        colliders.push(collider);
    }
    Ok(colliders)
}

impl Collider {
    /// Its reference point at time 0 (m), which poses place: a centre, the middle of a segment, or a given point. None of a shape
    /// that this client is too old to know.
    pub fn reference(&self) -> Option<[f64; 3]> {
        let middle = |start, end| {
            let (start, end) = (components(start), components(end));
            [0, 1, 2].map(|axis| 0.5 * (start[axis] + end[axis]))
        };
        Some(match self.shape.as_ref()? {
            Shape::Plane(s) => components(s.point),
            Shape::Sphere(s) => components(s.center),
            Shape::Capsule(s) => middle(s.start, s.end),
            Shape::Box(s) => components(s.center),
            Shape::Cylinder(s) => middle(s.start, s.end),
            Shape::HalfPipe(s) => components(s.point),
            Shape::Mesh(s) => components(s.origin),
        })
    }

    /// Takes the message and checks its numbers; an error is the collider's name and what is wrong.
    fn from_wire(wire: v1::ColliderShape) -> Result<Self, (String, &'static str)> {
        let v1::ColliderShape { name, velocity, shape } = wire;
        match finite(&[velocity]).and(shape.as_ref().map_or(Ok(()), check)) {
            Ok(()) => Ok(Self { name, shape, velocity: components(velocity) }),
            Err(what) => Err((name, what)),
        }
    }
}

/// The three numbers of a vector; an absent one is zero, as everywhere in proto3.
pub fn components(vector: Option<v1::Vector3>) -> [f64; 3] {
    vector.unwrap_or_default().into()
}

type Checked = Result<(), &'static str>;

/// What can be wrong with the numbers of each shape.
fn check(shape: &Shape) -> Checked {
    match shape {
        Shape::Plane(s) => finite(&[s.point]).and(unit(s.normal)),
        Shape::Sphere(s) => finite(&[s.center]).and(radius(s.radius)),
        Shape::Capsule(s) => finite(&[s.start, s.end]).and(radius(s.radius)),
        Shape::Box(s) => finite(&[s.center]).and(extent(s.half_extent)).and(right_angles(s.axis_x, s.axis_y)),
        Shape::Cylinder(s) => finite(&[s.start, s.end]).and(radius(s.radius)).and(apart(s.start, s.end)),
        Shape::HalfPipe(s) => finite(&[s.point]).and(radius(s.radius)).and(right_angles(s.axis, s.up)),
        Shape::Mesh(s) => finite(&[s.origin]).and(collider_mesh::check(s)),
    }
}

fn finite(vectors: &[Option<v1::Vector3>]) -> Checked {
    let all = vectors.iter().copied().flat_map(components).all(f64::is_finite);
    if all { Ok(()) } else { Err("a coordinate is not finite") }
}

fn radius(radius: f64) -> Checked {
    if radius.is_finite() && radius > 0.0 { Ok(()) } else { Err("its radius is not a positive number") }
}

fn extent(half: Option<v1::Vector3>) -> Checked {
    finite(&[half])?;
    let positive = components(half).iter().all(|half| *half > 0.0);
    if positive { Ok(()) } else { Err("half of its extent is not positive along each axis") }
}

fn apart(start: Option<v1::Vector3>, end: Option<v1::Vector3>) -> Checked {
    if components(start) == components(end) { Err("its two ends are one point") } else { Ok(()) }
}

/// A direction of length 1, up to rounding.
fn unit(direction: Option<v1::Vector3>) -> Checked {
    finite(&[direction])?;
    let length = dot(direction, direction).sqrt();
    if (length - 1.0).abs() > UNIT_TOLERANCE { Err("a direction of it is not of length 1") } else { Ok(()) }
}

/// Two directions of length 1 at right angles, up to rounding.
fn right_angles(a: Option<v1::Vector3>, b: Option<v1::Vector3>) -> Checked {
    unit(a).and(unit(b))?;
    if dot(a, b).abs() > UNIT_TOLERANCE {
        Err("two directions of it are not at right angles")
    } else {
        Ok(())
    }
}

fn dot(a: Option<v1::Vector3>, b: Option<v1::Vector3>) -> f64 {
    components(a).iter().zip(components(b)).map(|(a, b)| a * b).sum()
}
