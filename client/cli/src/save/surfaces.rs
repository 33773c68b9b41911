//! The mesh colliders of a session as one surface, to be written beside its frames.
//!
//! Enters: colliders. Leaves: the points of their surfaces at time 0 (m), and triangles over all of them.

use nappe_client::{Collider, Shape, mesh_points, mesh_triangles};

/// The surfaces of all mesh colliders, one after the other.
#[derive(Debug, Default)]
pub(super) struct Surfaces {
    /// x y z of each point (m).
    pub(super) points: Vec<f32>,
    /// Three indices of points each.
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Surfaces {
    /// Takes the surfaces of these colliders; those of other shapes have none.
    pub(super) fn of(colliders: &[Collider]) -> Self {
        let mut all = Self::default();
        for collider in colliders {
            let Some(Shape::Mesh(mesh)) = &collider.shape else { continue };
            let first = (all.points.len() / 3) as u32;
            all.points.extend(mesh_points(mesh).as_flattened());
            all.triangles
                .extend(mesh_triangles(mesh).iter().map(|corners| corners.map(|point| first + point)));
        }
        all
    }
}
