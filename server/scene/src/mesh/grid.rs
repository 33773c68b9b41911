//! The course's grids by formula.

use nappe_sim::mesh::TriangleMesh;

use super::numbers::to_six_digits;

/// The grid of the course's mesh tool, `columns` x `rows` points `spacing` (m) apart:
/// x = spacing c, y = -spacing r, z = 0.1 sin(-2.5 c), all rounded to 6 significant digits as its
/// files hold them; mass 0 at the two upper corners and 1 kg elsewhere; u = c/(columns-1),
/// v = 1 - r/(rows-1). Its triangles stand column by column.
pub fn course_grid(columns: usize, rows: usize, spacing: f64) -> TriangleMesh {
    let mut mesh = TriangleMesh::grid(columns, rows, spacing);
    // The cell at row r, column c has triangles 2 (r (columns - 1) + c) and the next.
    let cells = (columns.saturating_sub(1), rows.saturating_sub(1));
    let down = |c: usize| (0..cells.1).map(move |r| 2 * (r * cells.0 + c));
    mesh.triangles =
        (0..cells.0).flat_map(down).flat_map(|t| [mesh.triangles[t], mesh.triangles[t + 1]]).collect();
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
