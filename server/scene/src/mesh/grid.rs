//! The course's grids by formula.

use nappe_sim::mesh::TriangleMesh;

use super::numbers::to_six_digits;

/// The grid of the course's mesh tool, `columns` x `rows` points `spacing` (m) apart:
/// x = spacing c, y = -spacing r, z = 0.1 sin(-2.5 c), all rounded to 6 significant digits as its
/// files hold them; mass 0 at the two upper corners and 1 kg elsewhere; u = c/(columns-1),
/// v = 1 - r/(rows-1).
pub fn course_grid(columns: usize, rows: usize, spacing: f64) -> TriangleMesh {
    let mut mesh = TriangleMesh::grid(columns, rows, spacing);
    mesh.masses = vec![1.0; mesh.points.len()];
    for (i, point) in mesh.points.iter_mut().enumerate() {
        let (r, c) = (i / columns, i % columns);
        let y = if r == 0 { 0.0 } else { -spacing * r as f64 };
        *point = [spacing * c as f64, y, 0.1 * (-2.5 * c as f64).sin()].map(to_six_digits);
        if r == 0 && (c == 0 || c + 1 == columns) {
            mesh.masses[i] = 0.0;
        }
    }
    for uv in &mut mesh.uv {
        *uv = uv.map(to_six_digits);
    }
    mesh
}
