//! Endless colliders as meshes, as much of them as the scene needs: a plane, a trough.
//!
//! Enters: the collider's numbers (m), the bounds of the scene. Leaves: a mesh with normals, relative to the
//! collider's own point.

use crate::{
    geometry::{Bounds, along, cross, dot, minus, tangents, unit},
    sdk::{Color, Mesh3D},
};

const GROUND_COLOR: [u8; 3] = [70, 74, 82];
/// The foot of the bodies on a plane belongs to the scene, if it is within so many of their radii: where they
/// fall or fly to.
const FALL: f32 = 12.0;
/// How far down a slope bodies slide or roll within the picture, in halves of their smallest extent: a long
/// layer stays. And the height of the unit normal below which a plane is a slope.
const SLIDE: f32 = 10.0;
const LEVEL: f32 = 0.99;

/// Radius of the drawn disc over the radius of the scene.
const PLANE_SCALE: f32 = 1.4;
const DISC_CORNERS: u32 = 96;
/// The drawn surface lies this far below, over the radius of the scene: between particles that lie on a
/// surface, a triangle passes below it.
const DEPTH: f32 = 0.004;
/// Facets of a trough.
const TROUGH_FACETS: u32 = 48;

/// A surface without end, through a point of its own.
pub(crate) enum Ground {
    /// A plane: its unit normal.
    Plane([f32; 3]),
    /// The inside of a half-pipe.
    Trough(Trough),
}

impl Ground {
    /// As much of it as the scene needs, relative to its own point.
    pub(crate) fn mesh(&self, point: [f32; 3], scene: &Bounds) -> Mesh3D {
        let [red, green, blue] = GROUND_COLOR;
        let mesh = match self {
            Self::Plane(normal) => disc(point, *normal, scene),
            Self::Trough(trough) => trough.mesh(scene),
        };
        mesh.with_albedo_factor(*Color::from_rgb(red, green, blue))
    }

    /// Whether the eye is on the other side of a plane, from where it would hide the scene.
    pub(crate) fn hides_all_from(&self, eye: [f32; 3], point: [f32; 3]) -> bool {
        match self {
            Self::Plane(normal) => dot(minus(eye, point), *normal) <= 0.0,
            Self::Trough(_) => false,
        }
    }

    /// Grows the bounds of the scene by the foot of bodies that fly freely on a plane, and by where they slide to.
    pub(crate) fn add_foot_to(&self, scene: &mut Bounds, bodies: &Bounds, point: [f32; 3]) {
        let Self::Plane(normal) = *self else { return };
        let height = dot(minus(bodies.center(), point), normal);
        if height > 0.0 && height < FALL * bodies.radius() {
            let [x, y, z] = normal;
            let foot = along(bodies.center(), -height, normal);
            scene.add(foot);
            // What gravity leaves along the plane: (0, -1, 0) + y normal.
            if let Some(down) = unit([x * y, y * y - 1.0, z * y]).filter(|_| y > 0.0 && y < LEVEL) {
                scene.add(along(foot, SLIDE * bodies.half_width(), down));
            }
        }
    }
}

/// The part of a plane below the scene, as a disc, relative to `point`.
fn disc(point: [f32; 3], normal: [f32; 3], scene: &Bounds) -> Mesh3D {
    let [first, second] = tangents(normal);
    let to_center = minus(scene.center(), point);
    let height = dot(to_center, normal);
    let foot = along(along(to_center, -height, normal), -DEPTH * scene.radius(), normal);
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

/// The inside of a tube below its axis, as half-pipes have it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Trough {
    /// A point of the tube's axis (m).
    pub(crate) point: [f32; 3],
    /// Unit direction of the axis.
    pub(crate) axis: [f32; 3],
    /// Unit direction of the opening.
    pub(crate) up: [f32; 3],
    /// Inner radius (m).
    pub(crate) radius: f32,
}

impl Trough {
    /// The inner surface along the scene, with a bank on either side, relative to the trough's point.
    pub(crate) fn mesh(&self, scene: &Bounds) -> Mesh3D {
        let side = cross(self.up, self.axis);
        let middle = dot(minus(scene.center(), self.point), self.axis);
        let half_length = PLANE_SCALE * scene.radius();

        let profile = self.profile(half_length);
        let (mut positions, mut normals) = (Vec::new(), Vec::new());
        for ([across, height], normal) in &profile {
            for end in [middle - half_length, middle + half_length] {
                let position = along(along([0.0; 3], *across, side), *height, self.up);
                positions.push(along(position, end, self.axis));
                normals.push(along(along([0.0; 3], normal[0], side), normal[1], self.up));
            }
        }

        let strips = 0..profile.len() as u32 - 1;
        let triangles = strips.flat_map(|strip| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|corner| 2 * strip + corner);
            [[a, b, c], [c, b, d]]
        });
        Mesh3D::new(positions).with_vertex_normals(normals).with_triangle_indices(triangles)
    }

    /// Positions (across, up) from bank to bank (m), and the normals there.
    fn profile(&self, bank: f32) -> Vec<([f32; 2], [f32; 2])> {
        let (radius, up) = (self.radius, [0.0, 1.0]);
        let mut profile = vec![([-radius - bank, 0.0], up), ([-radius, 0.0], up)];
        for facet in 0..=TROUGH_FACETS {
            let angle = std::f32::consts::PI * (1.0 + facet as f32 / TROUGH_FACETS as f32);
            let outward = [angle.cos(), angle.sin()];
            profile.push((outward.map(|c| radius * c), outward.map(|c| -c)));
        }
        profile.extend([([radius, 0.0], up), ([radius + bank, 0.0], up)]);
        profile
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trough_lies_on_its_tube_and_looks_at_its_axis() {
        let trough = Trough { point: [0.0; 3], axis: [0.0, 0.0, 1.0], up: [0.0, 1.0, 0.0], radius: 2.0 };
        let profile = trough.profile(1.0);
        assert_eq!((profile[0].0, profile[profile.len() - 1].0), ([-3.0, 0.0], [3.0, 0.0]));
        for (position, normal) in &profile[2..profile.len() - 2] {
            let distance = position[0].hypot(position[1]);
            assert!((distance - 2.0).abs() < 1e-5 && position[1] < 1e-5, "{position:?}");
            assert!((position[0] * normal[0] + position[1] * normal[1] + 2.0).abs() < 1e-5, "{normal:?}");
        }
        let lowest = profile.iter().map(|(position, _)| position[1]).fold(0.0, f32::min);
        assert!((lowest + 2.0).abs() < 1e-5);
    }
}
