//! One collider to Rerun: a solid of its shape, or the part of an endless one that the scene needs, moving with
//! its velocity.
//!
//! Enters: `Collider` once, then the time (s) of each frame. Leaves: the shape once, then its position if it moves.

use nappe_client::{Collider, Shape};
use rerun::{
    AsComponents, Boxes3D, Capsules3D, Color, Cylinders3D, Ellipsoids3D, FillMode, RecordingStream,
    Transform3D,
};

use crate::{
    body::entity_name,
    error::{RerunError, refused},
    geometry::{Bounds, along, dot, length, minus, tangents, unit},
    ground::{Trough, disc},
};

const SOLID_COLOR: [u8; 3] = [150, 158, 170];
const GROUND_COLOR: [u8; 3] = [70, 74, 82];
/// A drawn solid over the solid: between particles that lie on a ball, a triangle passes below its surface.
const SOLID_SCALE: f32 = 0.985;
/// A solid adds to the bounds of the scene what lies within so many radii of the bodies: the camera need not
/// see the far end of a large floor.
const REACH: f32 = 3.0;
/// The foot of the bodies on a plane belongs to the scene, if it is within so many of their radii: where they
/// fall or fly to.
const FALL: f32 = 12.0;
/// How far down a slope bodies slide or roll within the picture, in halves of their smallest extent: a long
/// layer stays. And the height of the unit normal below which a plane is a slope.
const SLIDE: f32 = 10.0;
const LEVEL: f32 = 0.99;

/// How a collider is drawn.
pub(crate) struct ColliderView {
    path: String,
    shape: Shape,
}

impl ColliderView {
    /// Collider number `index` of a session.
    pub(crate) fn new(collider: &Collider, index: usize) -> Self {
        let path = format!("world/colliders/{}", entity_name(&collider.name, index));
        Self { path, shape: collider.shape }
    }

    /// The shape, as the server describes it.
    pub(crate) fn shape(&self) -> &Shape {
        &self.shape
    }

    /// Grows the bounds of the scene; endless shapes have none.
    pub(crate) fn add_to(&self, scene: &mut Bounds, bodies: &Bounds) {
        let mut add_ball = |center: [f64; 3], reach: f32| {
            for side in [reach, -reach] {
                scene.add(bodies.nearest(along(narrow(center), side, [1.0; 3]), REACH));
            }
        };
        match self.shape {
            Shape::Sphere { center, radius, .. } => {
                // A ball is all in the picture: bodies fall around it.
                let (center, radius) = (narrow(center), radius as f32);
                scene.add(along(center, radius, [1.0; 3]));
                scene.add(along(center, -radius, [1.0; 3]));
            }
            Shape::Capsule { start, end, radius, .. } | Shape::Cylinder { start, end, radius, .. } => {
                add_ball(start, radius as f32);
                add_ball(end, radius as f32);
            }
            Shape::Box { center, half_extent, .. } => add_ball(center, length(narrow(half_extent))),
            _ => {}
        }
    }

    /// Grows the bounds of the scene by the foot of bodies that fly freely on a plane, and by where they slide to.
    pub(crate) fn add_foot_to(&self, scene: &mut Bounds, bodies: &Bounds) {
        if let Shape::Plane { point, normal, .. } = self.shape {
            let height = dot(minus(bodies.center(), narrow(point)), narrow(normal));
            if height > 0.0 && height < FALL * bodies.radius() {
                let [x, y, z] = narrow(normal);
                let foot = along(bodies.center(), -height, [x, y, z]);
                scene.add(foot);
                // What gravity leaves along the plane: (0, -1, 0) + y normal.
                if let Some(down) = unit([x * y, y * y - 1.0, z * y]).filter(|_| y > 0.0 && y < LEVEL) {
                    scene.add(along(foot, SLIDE * bodies.half_width(), down));
                }
            }
        }
    }

    /// Logs the shape, around its own origin; not a plane that would hide the scene from the eye.
    pub(crate) fn describe(
        &self,
        stream: &RecordingStream,
        scene: &Bounds,
        eye: [f32; 3],
    ) -> Result<(), RerunError> {
        if let Shape::Plane { point, normal, .. } = self.shape
            && dot(minus(eye, narrow(point)), narrow(normal)) <= 0.0
        {
            return Ok(());
        }
        let Some(drawn) = self.drawn(scene) else { return Ok(()) };
        stream.log_static(&*self.path, drawn.as_ref()).map_err(refused(&self.path))?;
        if self.moves() {
            return Ok(());
        }
        stream.log_static(&*self.path, &self.transform(0.0)).map_err(refused(&self.path))
    }

    /// The shape around its own origin, axes as they are for Rerun: a capsule starts there and goes along z, a
    /// cylinder has its middle there.
    fn drawn(&self, scene: &Bounds) -> Option<Box<dyn AsComponents>> {
        let (solid, ground) = (rgb(SOLID_COLOR), rgb(GROUND_COLOR));
        Some(match self.shape {
            Shape::Sphere { radius, .. } => Box::new(
                Ellipsoids3D::from_radii([radius as f32 * SOLID_SCALE])
                    .with_colors([solid])
                    .with_fill_mode(FillMode::Solid),
            ),
            Shape::Box { half_extent, .. } => Box::new(
                Boxes3D::from_half_sizes([narrow(half_extent).map(|half| half * SOLID_SCALE)])
                    .with_colors([solid])
                    .with_fill_mode(FillMode::Solid),
            ),
            Shape::Capsule { start, end, radius, .. } => Box::new(
                Capsules3D::from_lengths_and_radii(
                    [length(minus(narrow(end), narrow(start)))],
                    [radius as f32 * SOLID_SCALE],
                )
                .with_colors([solid])
                .with_fill_mode(FillMode::Solid),
            ),
            Shape::Cylinder { start, end, radius, .. } => Box::new(
                Cylinders3D::from_lengths_and_radii(
                    [length(minus(narrow(end), narrow(start))) * SOLID_SCALE],
                    [radius as f32 * SOLID_SCALE],
                )
                .with_colors([solid])
                .with_fill_mode(FillMode::Solid),
            ),
            Shape::Plane { point, normal, .. } => {
                Box::new(disc(narrow(point), narrow(normal), scene).with_albedo_factor(*ground))
            }
            Shape::HalfPipe { point, axis, up, radius, .. } => {
                let [point, axis, up] = [point, axis, up].map(narrow);
                let trough = Trough { point, axis, up, radius: radius as f32 };
                Box::new(trough.mesh(scene).with_albedo_factor(*ground))
            }
            _ => return None,
        })
    }

    /// Logs the position at `time` (s), if the collider moves.
    pub(crate) fn log(&self, stream: &RecordingStream, time: f64) -> Result<(), RerunError> {
        if !self.moves() {
            return Ok(());
        }
        stream.log(&*self.path, &self.transform(time)).map_err(refused(&self.path))
    }

    fn moves(&self) -> bool {
        self.shape.velocity() != [0.0; 3]
    }

    fn transform(&self, time: f64) -> Transform3D {
        let origin = match self.shape {
            Shape::Plane { point, .. } | Shape::HalfPipe { point, .. } => point,
            Shape::Sphere { center, .. } | Shape::Box { center, .. } => center,
            Shape::Capsule { start, .. } => start,
            Shape::Cylinder { start, end, .. } => [0, 1, 2].map(|axis| 0.5 * (start[axis] + end[axis])),
            _ => [0.0; 3],
        };
        let velocity = self.shape.velocity();
        let at: [f32; 3] = std::array::from_fn(|axis| (origin[axis] + time * velocity[axis]) as f32);
        match self.columns() {
            Some(columns) => Transform3D::from_translation_mat3x3(at, columns),
            None => Transform3D::from_translation(at),
        }
    }

    /// Where the shape's own axes point, one a column; none if they are the world's.
    fn columns(&self) -> Option<[[f32; 3]; 3]> {
        match self.shape {
            Shape::Box { axes, .. } => Some(axes.map(narrow)),
            Shape::Capsule { start, end, .. } | Shape::Cylinder { start, end, .. } => {
                let along_z = unit(minus(narrow(end), narrow(start)))?;
                let [x, y] = tangents(along_z);
                Some([x, y, along_z])
            }
            _ => None,
        }
    }
}

pub(crate) fn narrow(v: [f64; 3]) -> [f32; 3] {
    v.map(|value| value as f32)
}

fn rgb([red, green, blue]: [u8; 3]) -> Color {
    Color::from_rgb(red, green, blue)
}
