//! Shapes of colliders, one file each: its numbers, what can be invalid, its signed distance.
//!
//! Lengths in metres. To add a shape: its file, its `mod`, its line in the list.

mod geometry;
#[cfg(test)]
mod sample;
mod plane;
mod sphere;
mod capsule;
mod cuboid;
mod cylinder;
mod half_pipe;
mod mesh;
#[cfg(test)]
mod tests;

pub use mesh::{FirstCrossing, NEAR_BYTES, SelfCrossings, Shell, Shells};

pub(super) use mesh::Near;

use geometry::{Probe, SignedDistance};

/// Makes the closed set of shapes from a list, and hands each question on to the shape's own file.
macro_rules! shapes {
    ($($(#[$about:meta])* $name:ident($module:ident::$shape:ident),)*) => {
        $(pub use $module::$shape;)*

        /// A shape at time 0.
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        pub enum Shape {
            $($(#[$about])* $name($shape),)*
        }

        impl Shape {
            /// Says which numbers make no shape, if any do.
            pub(super) fn invalid(&self) -> Option<String> {
                match self {
                    $(Self::$name(shape) => shape.invalid(),)*
                }
            }

            /// Signed distance (m) of a point (m) and unit normal of the shape, moved by `shift` (m).
            pub(super) fn distance(&self, point: [f64; 3], shift: [f64; 3]) -> (f64, [f64; 3]) {
                let probe = Probe { point, shift };
                match self {
                    $(Self::$name(shape) => shape.nearest(probe),)*
                }
            }

            /// The point (m) at time 0 that its position is that of, and about which it turns: its centre, the middle of its
            /// segment, the point that it is given by, or of a mesh where its transform puts the origin.
            pub fn reference(&self) -> [f64; 3] {
                match self {
                    $(Self::$name(shape) => shape.reference(),)*
                }
            }

            /// Least way (m) through its middle, from one side to the other; infinite where there is no other side.
            pub(crate) fn thickness(&self) -> f64 {
                match self {
                    $(Self::$name(shape) => shape.thickness(),)*
                }
            }

            /// How far (m) the farthest point of its surface is from its reference point; infinite where it has no end.
            pub(super) fn reach(&self) -> f64 {
                match self {
                    $(Self::$name(shape) => shape.reach(),)*
                }
            }

            /// Whether a particle outside may touch it at several places that look different ways.
            pub(crate) fn has_creases(&self) -> bool {
                match self {
                    $(Self::$name(shape) => shape.has_creases(),)*
                }
            }
        }

        $(impl From<$shape> for Shape {
            fn from(shape: $shape) -> Self {
                Self::$name(shape)
            }
        })*

        #[cfg(test)]
        impl Shape {
            /// One of each.
            pub(super) fn examples() -> Vec<Self> {
                vec![$(<$shape as sample::Sample>::example().into(),)*]
            }

            fn contains(&self, point: [f64; 3]) -> bool {
                match self {
                    $(Self::$name(shape) => sample::Sample::contains(shape, point),)*
                }
            }

            fn surface(&self) -> Vec<[f64; 3]> {
                match self {
                    $(Self::$name(shape) => sample::Sample::surface(shape),)*
                }
            }

            fn invalid_examples() -> Vec<(Self, &'static str)> {
                let mut all = Vec::new();
                $(all.extend(
                    <$shape as sample::Sample>::invalid_examples()
                        .into_iter()
                        .map(|(shape, named)| (Self::$name(shape), named)),
                );)*
                all
            }
        }
    };
}

shapes! {
    /// The half-space behind a plane.
    Plane(plane::Plane),
    /// A ball with a centre and a radius.
    Sphere(sphere::Sphere),
    /// All points within a distance of a segment.
    Capsule(capsule::Capsule),
    /// A box that may be turned.
    Box(cuboid::Cuboid),
    /// A solid cylinder with flat ends.
    Cylinder(cylinder::Cylinder),
    /// The ground below a trough.
    HalfPipe(half_pipe::HalfPipe),
    /// The solid within a closed mesh of triangles.
    Mesh(mesh::MeshSolid),
}
