//! The bodies of a scene as cells of a VTK file, packed once: cloth as triangles or springs, snow as vertices.
//!
//! Enters: bodies. Leaves: cells, and of each cell the number of its body.

use std::iter::repeat_n;

use nappe_client::Body;
use nappe_scene::{
    mesh::{VtpArray, VtpCells, VtpNumbers},
    printable,
};

/// Cells over the particles, which every frame repeats.
pub(super) struct Bodies {
    /// Their names in the scene.
    pub(super) names: Vec<String>,
    /// The number of the body of each cell.
    pub(super) cell_data: [VtpArray; 1],
    /// Particles of bodies that have neither triangles nor springs.
    pub(super) vertices: VtpCells,
    /// Springs of bodies without triangles.
    pub(super) lines: VtpCells,
    /// Triangles of all bodies that have some.
    pub(super) triangles: VtpCells,
}

impl Bodies {
    /// The cells of these bodies.
    pub(super) fn of(bodies: &[Body]) -> Self {
        let (mut vertices, mut lines, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
        // Of vertices, lines and triangles.
        let mut numbers: [Vec<i32>; 3] = [Vec::new(), Vec::new(), Vec::new()];
        for (number, body) in (0..).zip(bodies) {
            let (kind, count) = match (body.triangles.is_empty(), body.springs.is_empty()) {
                (false, _) => {
                    triangles.extend_from_slice(&body.triangles);
                    (2, body.triangles.len())
                }
                (true, false) => {
                    lines.extend_from_slice(&body.springs);
                    (1, body.springs.len())
                }
                (true, true) => {
                    let particles = body.first_particle..body.first_particle + body.particle_count;
                    vertices.extend(particles.map(|particle| [particle as u32]));
                    (0, body.particle_count)
                }
            };
            numbers[kind].extend(repeat_n(number, count));
        }
        Self {
            names: bodies.iter().map(|body| printable(&body.name).into_owned()).collect(),
            cell_data: [VtpArray::new("body", 1, VtpNumbers::I32(&numbers.concat()))],
            vertices: VtpCells::new(&vertices),
            lines: VtpCells::new(&lines),
            triangles: VtpCells::new(&triangles),
        }
    }
}
