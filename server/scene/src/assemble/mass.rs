//! Masses of a body's particles, from what the scene says or the mesh carries.

use nappe_sim::{
    math::array::{cross, length, minus},
    mesh::TriangleMesh,
};

use crate::{
    body::Mass,
    error::{ErrorKind, SceneError},
    location::Location,
};

/// What says the masses of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SaidBy {
    /// The key `mass`, or its mesh.
    Mass,
    /// A fabric, by its mass per area alone.
    Fabric,
}

impl SaidBy {
    /// The key of a body where it stands.
    pub(super) const fn key(self) -> &'static str {
        match self {
            Self::Mass => "mass",
            Self::Fabric => "material",
        }
    }
}

/// Writes the masses (kg) into the mesh. Returns the particles that the mesh pins with the mass 0
/// where the scene gives them another.
///
/// `at` is where the masses stand.
pub(super) fn apply(
    mass: Option<Mass>,
    mesh: &mut TriangleMesh,
    (said_by, at): (SaidBy, &Location<'_>),
) -> Result<Vec<u32>, SceneError> {
    let Some(mass) = mass else {
        if mesh.masses.is_empty() {
            let message = "is missing: this mesh carries no masses; allowed: { particle = kg }, { total = kg } or { density = kg/m^2 }";
            return Err(at.error(ErrorKind::Missing, message));
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
        let is_unused =
            !mesh.triangles.is_empty() && !mesh.triangles.iter().flatten().any(|p| *p as usize == i);
        let why = if is_unused { "no triangle names it" } else { "its triangles have no area" };
        let allowed = match (said_by, is_unused) {
            (SaidBy::Mass, false) => "{ particle = kg } or { total = kg }",
            (SaidBy::Mass, true) => {
                "unused = \"drop\" in its mesh, which leaves such points out, { particle = kg } or { total = kg }"
            }
            (SaidBy::Fabric, false) => "a mesh whose points are all corners of triangles with an area",
            (SaidBy::Fabric, true) => "unused = \"drop\" in its mesh, which leaves such points out",
        };
        let mass = mesh.masses[i];
        let message = format!("gives particle {i} the mass {mass}: {why}; allowed here: {allowed}");
        return at.inconsistent(message);
    }

    Ok(pinned)
}

/// A third of the area (m²) of its triangles, for each point.
fn areas(mesh: &TriangleMesh) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.points.len()];
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|i| mesh.points[i as usize]);
        let (u, v) = (minus(b, a), minus(c, a));
        let third = length(cross(u, v)) / 6.0;
        for &i in corners {
            areas[i as usize] += third;
        }
    }
    areas
}
