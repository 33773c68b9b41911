//! What the viewer knows of a collider's shape: where it is, what it hides, and how it is drawn.
//!
//! Enters: the contract's shape, checked by the client. Leaves: an [`Outline`], after which no shape is told
//! from another but by these parts. To add a shape: its arm in [`Outline::of`].

use nappe_client::{Shape, components, mesh_points, mesh_triangles, v1::Vector3};

use crate::{
    extent::Extent,
    facets::Facets,
    geometry::{cross, length, minus, narrow, tangents, unit},
    ground::{Ground, Trough},
    sdk::{AsComponents, Boxes3D, Capsules3D, Color, Cylinders3D, Ellipsoids3D, FillMode},
};

const SOLID_COLOR: [u8; 3] = [150, 158, 170];
/// A drawn solid over the solid: between particles that lie on a ball, a triangle passes below its surface.
const SOLID_SCALE: f32 = 0.985;

/// A shape as the viewer sees it.
pub(crate) struct Outline {
    /// Its own origin at time 0 (m).
    pub(crate) origin: [f64; 3],
    /// Where its own axes point, one per column; none: along the world's.
    pub(crate) axes: Option<[[f32; 3]; 3]>,
    /// What it fills at time 0.
    pub(crate) extent: Extent,
    /// How it is drawn, around its own origin.
    pub(crate) drawing: Drawing,
}

/// How a shape is drawn.
pub(crate) enum Drawing {
    /// A solid, whole.
    Solid(Box<dyn AsComponents + Send>),
    /// As much of an endless surface as the scene needs.
    Ground(Ground),
}

impl Outline {
    /// The outline of a shape.
    pub(crate) fn of(shape: &Shape) -> Self {
        match shape {
            Shape::Plane(s) => Self::ground(s.point, Ground::Plane(direction(s.normal))),
            Shape::Sphere(s) => {
                let drawn = Ellipsoids3D::from_radii([drawn(s.radius)]);
                Self::ball(s.center, s.radius, drawn.with_colors([solid()]).with_fill_mode(FULL))
            }
            Shape::Capsule(s) => {
                // Rerun's capsule starts at its origin and goes along z.
                let length = length(between(s.start, s.end));
                let drawn = Capsules3D::from_lengths_and_radii([length], [drawn(s.radius)]);
                let drawn = drawn.with_colors([solid()]).with_fill_mode(FULL);
                Self::rod([s.start, s.end], s.radius, 0.0, drawn)
            }
            Shape::Box(s) => {
                let (half, axes) = (direction(s.half_extent), [direction(s.axis_x), direction(s.axis_y)]);
                let axes = [axes[0], axes[1], cross(axes[0], axes[1])];
                let drawn = Boxes3D::from_half_sizes([half.map(|half| half * SOLID_SCALE)]);
                Self {
                    origin: components(s.center),
                    axes: Some(axes),
                    extent: Extent::Box { center: direction(s.center), half, axes },
                    drawing: Drawing::Solid(Box::new(drawn.with_colors([solid()]).with_fill_mode(FULL))),
                }
            }
            Shape::Cylinder(s) => {
                // Rerun's cylinder has its middle at its origin and goes along z.
                let length = length(between(s.start, s.end)) * SOLID_SCALE;
                let drawn = Cylinders3D::from_lengths_and_radii([length], [drawn(s.radius)]);
                let drawn = drawn.with_colors([solid()]).with_fill_mode(FULL);
                Self::rod([s.start, s.end], s.radius, 0.5, drawn)
            }
            Shape::Mesh(s) => {
                let facets = Facets::of(&mesh_points(s), &mesh_triangles(s));
                Self {
                    origin: facets.bounds.center().map(f64::from),
                    axes: None,
                    extent: Extent::Ellipsoid(facets.bounds),
                    drawing: Drawing::Solid(Box::new(facets.mesh().with_albedo_factor(*solid()))),
                }
            }
            Shape::HalfPipe(s) => {
                let [point, axis, up] = [s.point, s.axis, s.up].map(direction);
                let trough = Trough { point, axis, up, radius: s.radius as f32 };
                Self::ground(s.point, Ground::Trough(trough))
            }
        }
    }

    /// A solid that a ball holds, drawn along the world's axes.
    fn ball(center: Option<Vector3>, radius: f64, drawn: impl AsComponents + Send + 'static) -> Self {
        Self {
            origin: components(center),
            axes: None,
            extent: Extent::Ball { center: direction(center), radius: radius as f32 },
            drawing: Drawing::Solid(Box::new(drawn)),
        }
    }

    /// A round solid along a segment. Its own z goes from start to end; its origin is `share` of the way.
    fn rod(
        [start, end]: [Option<Vector3>; 2],
        radius: f64,
        share: f64,
        drawn: impl AsComponents + Send + 'static,
    ) -> Self {
        let (from, to) = (components(start), components(end));
        let along_z = unit(between(start, end));
        Self {
            origin: [0, 1, 2].map(|axis| (1.0 - share) * from[axis] + share * to[axis]),
            axes: along_z.map(|z| {
                let [x, y] = tangents(z);
                [x, y, z]
            }),
            extent: Extent::Rod { start: narrow(from), end: narrow(to), radius: radius as f32 },
            drawing: Drawing::Solid(Box::new(drawn)),
        }
    }

    /// A surface without end.
    fn ground(point: Option<Vector3>, ground: Ground) -> Self {
        Self {
            origin: components(point),
            axes: None,
            extent: Extent::Endless,
            drawing: Drawing::Ground(ground),
        }
    }
}

const FULL: FillMode = FillMode::Solid;

fn solid() -> Color {
    let [red, green, blue] = SOLID_COLOR;
    Color::from_rgb(red, green, blue)
}

fn drawn(radius: f64) -> f32 {
    radius as f32 * SOLID_SCALE
}

fn direction(vector: Option<Vector3>) -> [f32; 3] {
    narrow(components(vector))
}

fn between(start: Option<Vector3>, end: Option<Vector3>) -> [f32; 3] {
    minus(direction(end), direction(start))
}
