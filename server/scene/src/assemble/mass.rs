//! Masses of a body's particles, from what the scene says or the mesh carries.

use nappe_sim::mesh::TriangleMesh;

use super::body::Context;
use crate::{
    body::Mass,
    error::{Fault, SceneError},
};

/// Writes the masses (kg) into the mesh. Returns the particles that the mesh pins with the mass 0
/// where the scene gives them another.
pub(super) fn apply(context: &Context<'_>, mesh: &mut TriangleMesh) -> Result<Vec<u32>, SceneError> {
    let path = context.path.key("mass");
    let Some(mass) = context.body.mass else {
        if mesh.masses.is_empty() {
            let message = "is missing: this mesh carries no masses; allowed: { particle = kg }, { total = kg } or { density = kg/m^2 }";
            return Err(context.source.error(Fault::Missing, &path, message));
        }
        return Ok(Vec::new());
    };
    let pinned: Vec<u32> = (0u32..).zip(&mesh.masses).filter(|(_, m)| **m == 0.0).map(|(i, _)| i).collect();
    let count = mesh.points.len();
    mesh.masses = match mass {
        Mass::Particle(mass) => vec![mass; count],
        Mass::Total(mass) => vec![mass / count as f64; count],
        Mass::Density(density) => areas(mesh).into_iter().map(|area| density * area).collect(),
    };
    if let Some(i) = mesh.masses.iter().position(|m| *m <= 0.0 || !m.is_finite()) {
        let message = format!(
            "gives particle {i} the mass {}: its triangles have no area; allowed here: {{ particle = kg }} or {{ total = kg }}",
            mesh.masses[i]
        );
        return Err(context.source.error(Fault::Inconsistent, &path, message));
    }
    Ok(pinned)
}

/// A third of the area (m²) of its triangles, for each point.
fn areas(mesh: &TriangleMesh) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.points.len()];
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|i| mesh.points[i as usize]);
        let (u, v) = ([0, 1, 2].map(|i| b[i] - a[i]), [0, 1, 2].map(|i| c[i] - a[i]));
        let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let third = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt() / 6.0;
        for &i in corners {
            areas[i as usize] += third;
        }
    }
    areas
}
