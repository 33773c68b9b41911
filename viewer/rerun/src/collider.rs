//! One collider to Rerun: a solid ball or a disc of its plane, moving with its velocity.
//!
//! Enters: `Collider` once, then the time (s) of each frame. Leaves: the shape once, then its place if it moves.

use nappe_client::{Collider, Shape};
use rerun::{Color, Ellipsoids3D, FillMode, Mesh3D, RecordingStream, Transform3D};

use crate::{
    body::entity_name,
    error::{RerunError, refused},
    geometry::{Bounds, along, dot, minus, tangents},
};

const SPHERE_COLOR: [u8; 3] = [150, 158, 170];
const PLANE_COLOR: [u8; 3] = [70, 74, 82];
/// The drawn ball over the ball: between particles that lie on a ball, a triangle passes below its surface.
const SPHERE_SCALE: f32 = 0.985;
/// Radius of the drawn disc over the radius of the scene.
const PLANE_SCALE: f32 = 1.4;
const DISC_CORNERS: u32 = 96;
/// The drawn plane lies this far below, over the radius of the scene, for the same reason.
const PLANE_DEPTH: f32 = 0.004;

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

    /// Grows the bounds of the scene; a plane has none.
    pub(crate) fn add_to(&self, bounds: &mut Bounds) {
        if let Shape::Sphere { center, radius, .. } = self.shape {
            let (center, radius) = (narrow(center), radius as f32);
            bounds.add(along(center, radius, [1.0; 3]));
            bounds.add(along(center, -radius, [1.0; 3]));
        }
    }

    /// Logs the shape, around its own origin.
    pub(crate) fn describe(&self, stream: &RecordingStream, scene: &Bounds) -> Result<(), RerunError> {
        let [red, green, blue] = match self.shape {
            Shape::Plane { .. } => PLANE_COLOR,
            _ => SPHERE_COLOR,
        };
        let color = Color::from_rgb(red, green, blue);
        let logged = match self.shape {
            Shape::Sphere { radius, .. } => {
                let ball = Ellipsoids3D::from_radii([radius as f32 * SPHERE_SCALE])
                    .with_colors([color])
                    .with_fill_mode(FillMode::Solid);
                stream.log_static(&*self.path, &ball)
            }
            Shape::Plane { point, normal, .. } => {
                let disc = disc(narrow(point), narrow(normal), scene).with_albedo_factor(*color);
                stream.log_static(&*self.path, &disc)
            }
            _ => return Ok(()),
        };
        logged.map_err(refused(&self.path))?;
        if self.moves() {
            return Ok(());
        }
        stream.log_static(&*self.path, &self.place(0.0)).map_err(refused(&self.path))
    }

    /// Logs the place at `time` (s), if the collider moves.
    pub(crate) fn log(&self, stream: &RecordingStream, time: f64) -> Result<(), RerunError> {
        if !self.moves() {
            return Ok(());
        }
        stream.log(&*self.path, &self.place(time)).map_err(refused(&self.path))
    }

    fn moves(&self) -> bool {
        match self.shape {
            Shape::Plane { velocity, .. } | Shape::Sphere { velocity, .. } => velocity != [0.0; 3],
            _ => false,
        }
    }

    fn place(&self, time: f64) -> Transform3D {
        let (origin, velocity) = match self.shape {
            Shape::Plane { point, velocity, .. } => (point, velocity),
            Shape::Sphere { center, velocity, .. } => (center, velocity),
            _ => ([0.0; 3], [0.0; 3]),
        };
        let at: [f32; 3] = std::array::from_fn(|axis| (origin[axis] + time * velocity[axis]) as f32);
        Transform3D::from_translation(at)
    }
}

/// The part of a plane below the scene, as a disc, relative to `point`.
fn disc(point: [f32; 3], normal: [f32; 3], scene: &Bounds) -> Mesh3D {
    let [first, second] = tangents(normal);
    let to_center = minus(scene.center(), point);
    let height = dot(to_center, normal);
    let foot = along(along(to_center, -height, normal), -PLANE_DEPTH * scene.radius(), normal);
    let radius = PLANE_SCALE * scene.radius();
    let rim = (0..DISC_CORNERS).map(|corner| {
        let angle = std::f32::consts::TAU * corner as f32 / DISC_CORNERS as f32;
        along(along(foot, radius * angle.cos(), first), radius * angle.sin(), second)
    });
    let triangles = (0..DISC_CORNERS).map(|corner| [0, 1 + corner, 1 + (corner + 1) % DISC_CORNERS]);
    Mesh3D::new(std::iter::once(foot).chain(rim))
        .with_vertex_normals(vec![normal; 1 + DISC_CORNERS as usize])
        .with_triangle_indices(triangles)
}

fn narrow(v: [f64; 3]) -> [f32; 3] {
    v.map(|value| value as f32)
}
