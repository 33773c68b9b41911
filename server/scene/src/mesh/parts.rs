//! The parts of a closed mesh, which no edge joins: each with its volume, the box around it and its first triangle.

use nappe_sim::mesh::Groups;

/// A part of a closed mesh.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Part {
    /// Its first triangle, as the file numbers them.
    pub(crate) first: u32,
    /// Volume (m³) by the divergence theorem: above 0 for a solid, below 0 for a hole.
    pub(crate) volume: f64,
    /// Lower and upper corner of the box around it (m).
    pub(crate) bounds: [[f64; 3]; 2],
    /// The apex of its tetrahedra (m).
    apex: [f64; 3],
}

impl Part {
    fn new(first: u32, apex: [f64; 3]) -> Self {
        Self { first, volume: 0.0, bounds: [apex; 2], apex }
    }

    fn add(&mut self, corners: [[f64; 3]; 3]) {
        self.volume += tetrahedron(corners.map(|p| [0, 1, 2].map(|c| p[c] - self.apex[c]))) / 6.0;
        for p in corners {
            let [low, high] = self.bounds;
            self.bounds = [[0, 1, 2].map(|c| low[c].min(p[c])), [0, 1, 2].map(|c| high[c].max(p[c]))];
        }
    }
}

/// Six times the volume of a tetrahedron with an apex at the origin.
pub(super) fn tetrahedron([a, b, c]: [[f64; 3]; 3]) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// The part of each triangle, and the parts in the order of their first triangles. `triangles` stand with their numbers in the
/// file, and `joined` holds those together that share an edge.
pub(super) fn parts(
    points: &[[f64; 3]],
    triangles: &[(u32, [u32; 3])],
    mut joined: Groups,
) -> (Vec<u32>, Vec<Part>) {
    let mut parts: Vec<Part> = Vec::new();
    let mut of_triangle: Vec<u32> = Vec::with_capacity(triangles.len());
    for (place, (number, corners)) in (0u32..).zip(triangles) {
        let corners = corners.map(|i| points[i as usize]);
        let first = joined.first(place);
        let part = if first == place {
            parts.push(Part::new(*number, corners[0]));
            parts.len() as u32 - 1
        } else {
            of_triangle[first as usize]
        };
        parts[part as usize].add(corners);
        of_triangle.push(part);
    }

    // A mesh may be turned inside out as a whole.
    if parts.iter().map(|part| part.volume).sum::<f64>() < 0.0 {
        for part in &mut parts {
            part.volume = -part.volume;
        }
    }
    (of_triangle, parts)
}
