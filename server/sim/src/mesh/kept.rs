//! Points that stay of a mesh: those that triangles or springs name, or any others; both are numbered anew.

use super::TriangleMesh;

impl TriangleMesh {
    /// Leaves out the points that no triangle and no spring names; the others keep their order. Returns how many are gone.
    ///
    /// # Panics
    /// On a mesh that [`TriangleMesh::validate`] refuses.
    pub fn drop_unused(&mut self) -> usize {
        let before = self.points.len();
        let mut is_kept = vec![false; before];
        let of_springs = self.springs.iter().flat_map(|spring| &spring.points);
        let named = self.triangles.iter().flatten().chain(of_springs);
        named.for_each(|&point| is_kept[point as usize] = true);
        keep(self, &is_kept);
        before - self.points.len()
    }
}

/// Keeps the points for which `is_kept` holds, in their order; triangles and springs must name no others.
pub(super) fn keep(mesh: &mut TriangleMesh, is_kept: &[bool]) {
    let mut next = 0_u32;
    let mut places = Vec::with_capacity(is_kept.len());
    for &kept in is_kept {
        places.push(next);
        next += u32::from(kept);
    }

    retain(&mut mesh.points, is_kept);
    retain(&mut mesh.masses, is_kept);
    retain(&mut mesh.uv, is_kept);
    retain(&mut mesh.velocities, is_kept);
    let of_springs = mesh.springs.iter_mut().flat_map(|spring| &mut spring.points);
    for point in mesh.triangles.iter_mut().flatten().chain(of_springs) {
        *point = places[*point as usize];
    }
}

fn retain<T>(values: &mut Vec<T>, is_kept: &[bool]) {
    let mut kept = is_kept.iter().copied();
    values.retain(|_| kept.next().unwrap_or(false));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{MeshSpring, SpringKind};

    #[test]
    fn points_without_triangles_and_springs_go_and_the_others_keep_what_is_theirs() {
        let spring = |points| MeshSpring {
            points,
            kind: SpringKind::Bend,
            stiffness: 1.0,
            damping: 0.0,
            rest_length: None,
        };
        let mut mesh = TriangleMesh {
            points: (0..6).map(|i| [f64::from(i), 0.0, 0.0]).collect(),
            triangles: vec![[5, 1, 3]],
            masses: (0..6).map(f64::from).collect(),
            springs: vec![spring([4, 1])],
            ..TriangleMesh::default()
        };
        assert_eq!(mesh.drop_unused(), 2);
        let expected = TriangleMesh {
            points: [1.0, 3.0, 4.0, 5.0].map(|x| [x, 0.0, 0.0]).to_vec(),
            triangles: vec![[3, 0, 1]],
            masses: vec![1.0, 3.0, 4.0, 5.0],
            springs: vec![spring([2, 0])],
            ..TriangleMesh::default()
        };
        assert_eq!(mesh, expected);
        assert_eq!(mesh.drop_unused(), 0);
        assert_eq!(mesh, expected);
    }
}
