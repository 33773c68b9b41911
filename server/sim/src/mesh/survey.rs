//! What a mesh is as a whole: its parts, its borders, vertices that lie on edges which do not name them.

use super::{
    TriangleMesh,
    groups::Groups,
    junctions::{OpenEdge, TJunctions, t_junctions},
};

/// What a mesh is as a whole. Points are told apart by their index, also where they lie at the same place, and a triangle
/// that repeats another does not count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Survey {
    /// Parts that share no points.
    pub parts: usize,
    /// Edges of one triangle alone.
    pub open_edges: usize,
    /// Pieces in which these hang together; where no two pieces share a point, each is a loop.
    pub boundary_loops: usize,
    /// Vertices on open edges that do not name them, within 1e-6 of the edge's length.
    pub t_junctions: TJunctions,
}

impl TriangleMesh {
    /// Looks at the mesh as a whole.
    ///
    /// # Panics
    /// On a mesh that [`TriangleMesh::validate`] refuses.
    pub fn survey(&self) -> Survey {
        let around = self.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [a, c]]);
        let edges = self.open_edges();
        Survey {
            parts: pieces(self.points.len(), around),
            open_edges: edges.len(),
            boundary_loops: pieces(self.points.len(), edges.iter().map(|edge| edge.ends)),
            t_junctions: t_junctions(&self.points, &edges),
        }
    }

    /// Edges of one triangle alone, in ascending order.
    fn open_edges(&self) -> Vec<OpenEdge> {
        let sides = self.sides();
        let edges = sides.chunk_by(|(p, (q, _)), (r, (s, _))| [p, q] == [r, s]);
        let open = edges.filter(|sides| sides.len() == 1).map(|sides| {
            let (p, (q, opposite)) = sides[0];
            OpenEdge { ends: [p, q], opposite }
        });
        open.collect()
    }
}

/// Pieces in which pairs of points hang together.
fn pieces(points: usize, pairs: impl Iterator<Item = [u32; 2]>) -> usize {
    let mut groups = Groups::new(points);
    let mut is_named = vec![false; points];
    for pair in pairs {
        groups.join(pair);
        for point in pair {
            is_named[point as usize] = true;
        }
    }
    (0u32..).zip(is_named).filter(|&(point, is_named)| is_named && groups.first(point) == point).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_borders_and_junctions_are_counted() {
        let sheet = TriangleMesh::grid(4, 3, 0.1);
        let whole =
            Survey { parts: 1, open_edges: 10, boundary_loops: 1, t_junctions: TJunctions::default() };
        assert_eq!(sheet.survey(), whole);

        // A larger sheet with a hole where an inner cell was, the small one beside it, and a point without triangles.
        let mut holed = TriangleMesh::grid(5, 5, 0.1);
        holed.triangles.drain(2 * 5..2 * 6);
        let shift = holed.points.len() as u32;
        holed.points.extend(sheet.points.iter().map(|x| [x[0], x[1] + 1.0, x[2]]));
        holed.triangles.extend(sheet.triangles.iter().map(|t| t.map(|point| point + shift)));
        holed.points.push([7.0; 3]);
        let found = holed.survey();
        assert_eq!((found.parts, found.open_edges, found.boundary_loops), (2, 16 + 4 + 10, 3));

        // Each triangle twice has the same borders.
        let twice = TriangleMesh { triangles: sheet.triangles.repeat(2), ..sheet.clone() };
        assert_eq!(twice.survey(), whole);
        let empty = Survey { parts: 0, open_edges: 0, boundary_loops: 0, ..whole };
        assert_eq!(TriangleMesh { triangles: Vec::new(), ..sheet }.survey(), empty);
    }

    #[test]
    fn a_vertex_in_the_middle_of_an_edge_is_a_t_junction() {
        // A large triangle above the edge 0 to 1, two small ones below it, which meet at 3.
        let mesh = TriangleMesh {
            points: vec![[0.0; 3], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, -1.0, 0.0]],
            triangles: vec![[0, 1, 2], [0, 4, 3], [3, 4, 1]],
            ..TriangleMesh::default()
        };
        let found = mesh.survey();
        let expected = TJunctions { count: 1, first: Some((3, [0, 1])), is_cut_off: false };
        assert_eq!((found.parts, found.open_edges, found.t_junctions), (1, 7, expected));
    }
}
