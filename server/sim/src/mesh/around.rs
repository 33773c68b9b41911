//! What lies around each triangle: the points across its edges.
//!
//! Reads triangles; gives six points of each, or the first edge at which that is not defined.

use super::{TriangleMesh, corners::is_degenerate, repeats::drop_repeats};
use crate::interrupt;

impl TriangleMesh {
    /// Each triangle once, in their order; those that name a point twice are left out.
    ///
    /// # Panics
    /// On a mesh that [`TriangleMesh::check`] refuses.
    pub(crate) fn each_once(&self) -> Vec<[u32; 3]> {
        let mut triangles = self.triangles.clone();
        drop_repeats(&mut triangles, self.points.len());
        triangles.retain(|triangle| !is_degenerate(triangle));
        triangles
    }

    /// Each triangle once: its corners, and the points opposite to them across its edges. Where an edge has no other triangle,
    /// or more than one, the corner opposite to it stands again. Triangles that name a point twice are left out.
    ///
    /// # Panics
    /// On a mesh that [`TriangleMesh::check`] refuses.
    pub fn surrounded(&self) -> Vec<[u32; 6]> {
        let sides = self.sides();
        let across = |corner: u32, [p, q]: [u32; 2]| {
            let edge = (p.min(q), p.max(q));
            let first = sides.partition_point(|&(a, (b, _))| (a, b) < edge);
            let count = sides[first..].iter().take_while(|&&(a, (b, _))| (a, b) == edge).count();
            match &sides[first..first + count] {
                &[(_, (_, one)), (_, (_, other))] => {
                    if one == corner {
                        other
                    } else {
                        one
                    }
                }
                _ => corner,
            }
        };
        let around = |&[a, b, c]: &[u32; 3]| {
            interrupt::point();
            [a, b, c, across(a, [b, c]), across(b, [c, a]), across(c, [a, b])]
        };
        self.each_once().iter().map(around).collect()
    }

    /// The first edge that more than two triangles share; triangles of the same three points count once.
    ///
    /// # Panics
    /// On a mesh that [`TriangleMesh::check`] refuses.
    pub fn crowded_edge(&self) -> Option<[u32; 2]> {
        let sides = self.sides();
        let edge = |side: &(u32, (u32, u32))| [side.0, side.1.0];
        sides.windows(3).find(|three| edge(&three[0]) == edge(&three[2])).map(|three| edge(&three[0]))
    }
}

#[cfg(test)]
mod tests {
    use super::TriangleMesh;

    fn mesh(points: usize, triangles: &[[u32; 3]]) -> TriangleMesh {
        TriangleMesh {
            points: vec![[0.0; 3]; points],
            triangles: triangles.to_vec(),
            ..TriangleMesh::default()
        }
    }

    #[test]
    fn each_triangle_has_the_points_across_its_edges_or_its_own() {
        // A triangle with all three neighbours, one of them twice and turned round, and one that names a point twice.
        let mesh = mesh(6, &[[0, 1, 2], [3, 2, 1], [0, 2, 4], [1, 0, 5], [2, 4, 0], [4, 4, 5]]);
        let expected = [[0, 1, 2, 3, 4, 5], [3, 2, 1, 0, 2, 1], [0, 2, 4, 0, 2, 1], [1, 0, 5, 1, 0, 2]];
        assert_eq!(mesh.surrounded(), expected);
        assert_eq!(mesh.crowded_edge(), None);
    }

    #[test]
    fn an_edge_of_three_triangles_has_no_points_across_and_is_found() {
        let mesh = mesh(5, &[[0, 1, 2], [1, 0, 3], [0, 1, 4]]);
        assert_eq!(mesh.surrounded(), [[0, 1, 2, 0, 1, 2], [1, 0, 3, 1, 0, 3], [0, 1, 4, 0, 1, 4]]);
        assert_eq!(mesh.crowded_edge(), Some([0, 1]));
    }
}
