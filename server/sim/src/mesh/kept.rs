//! Points that stay of a mesh: those that triangles name, or any others; triangles are numbered anew.

use super::TriangleMesh;

impl TriangleMesh {
    /// Leaves out the points that no triangle names; the others keep their order. Returns how many are gone.
    ///
    /// # Panics
    /// On a mesh that [`TriangleMesh::validate`] refuses.
    pub fn drop_unused(&mut self) -> usize {
        let before = self.points.len();
        let mut is_kept = vec![false; before];
        self.triangles.iter().flatten().for_each(|&point| is_kept[point as usize] = true);
        keep(self, &is_kept);
        before - self.points.len()
    }
}

/// Keeps the points for which `is_kept` holds, in their order; triangles must name no others.
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
    for point in mesh.triangles.iter_mut().flatten() {
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

    #[test]
    fn points_without_triangles_go_and_the_others_keep_what_is_theirs() {
        let mut mesh = TriangleMesh {
            points: (0..6).map(|i| [f64::from(i), 0.0, 0.0]).collect(),
            triangles: vec![[5, 1, 3]],
            masses: (0..6).map(f64::from).collect(),
            uv: Vec::new(),
            velocities: Vec::new(),
        };
        assert_eq!(mesh.drop_unused(), 3);
        let expected = TriangleMesh {
            points: vec![[1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [5.0, 0.0, 0.0]],
            triangles: vec![[2, 0, 1]],
            masses: vec![1.0, 3.0, 5.0],
            uv: Vec::new(),
            velocities: Vec::new(),
        };
        assert_eq!(mesh, expected);
        assert_eq!(mesh.drop_unused(), 0);
        assert_eq!(mesh, expected);
    }
}
