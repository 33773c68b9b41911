//! Flat sheets of triangles to test with: square cells whose diagonals run one way, alternate or are random, and irregular triangles.

use std::{collections::BTreeMap, f64::consts::PI};

use nappe_sim::{
    math::array::{cross, dot, length, minus},
    mesh::TriangleMesh,
};

/// Share of a cell by which a point of an irregular sheet leaves its place along each axis, at most.
const MOVED: f64 = 0.25;

/// Which way the diagonals of a grid run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Diagonals {
    /// All as those of `TriangleMesh::grid`.
    OneWay,
    /// All across them.
    OtherWay,
    /// In turn, as the colours of a chessboard.
    Alternating,
    /// Without a pattern, the same in every run.
    Random,
}

impl Diagonals {
    fn is_first(self, column: usize, row: usize) -> bool {
        match self {
            Self::OneWay => true,
            Self::OtherWay => false,
            Self::Alternating => (column + row).is_multiple_of(2),
            Self::Random => noise(32 * row + column) > 0.0,
        }
    }
}

/// Numbers of [-1, 1] that have no pattern, the same in every run.
pub fn noise(i: usize) -> f64 {
    let mut hash = (i as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    hash = (hash ^ (hash >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    hash = (hash ^ (hash >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((hash ^ (hash >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// A grid of square cells in the plane y = 0, whose points are numbered as those of `TriangleMesh::grid`.
pub fn grid([columns, rows]: [usize; 2], spacing: f64, diagonals: Diagonals) -> TriangleMesh {
    let mut mesh = TriangleMesh::grid(columns + 1, rows + 1, spacing);
    for (cell, pair) in mesh.triangles.as_chunks_mut::<2>().0.iter_mut().enumerate() {
        let (column, row) = (cell % columns, cell / columns);
        if !diagonals.is_first(column, row) {
            let a = (row * (columns + 1) + column) as u32;
            let [b, c, d] = [a + 1, a + columns as u32 + 1, a + columns as u32 + 2];
            *pair = [[a, b, d], [a, d, c]];
        }
    }
    mesh
}

/// The rectangle of such a grid in irregular triangles: points are up to a quarter of a cell off their places, those of the rim
/// along it, and edges are those of Delaunay. Points of the first `still` columns, and corners, stay where they are.
pub fn irregular([columns, rows]: [usize; 2], spacing: f64, still: usize) -> TriangleMesh {
    let mut mesh = TriangleMesh::grid(columns + 1, rows + 1, spacing);
    for (point, place) in mesh.points.iter_mut().enumerate() {
        let (column, row) = (point % (columns + 1), point / (columns + 1));
        if column >= still && column > 0 && column < columns {
            place[0] += MOVED * spacing * noise(2 * point);
        }
        if column >= still && row > 0 && row < rows {
            place[2] += MOVED * spacing * noise(2 * point + 1);
        }
    }
    turn_edges(&mut mesh);
    mesh
}

/// Turns edges of a flat mesh until the angles opposite to each are half a circle together at most: the triangulation of Delaunay,
/// as far as rounding tells (Lawson 1977).
fn turn_edges(mesh: &mut TriangleMesh) {
    loop {
        // Of each side, the triangle that it runs around and the corner opposite to it.
        let mut sides: BTreeMap<[u32; 2], (usize, u32)> = BTreeMap::new();
        for (number, [a, b, c]) in mesh.triangles.iter().copied().enumerate() {
            sides.extend([([a, b], (number, c)), ([b, c], (number, a)), ([c, a], (number, b))]);
        }

        let mut is_turned = vec![false; mesh.triangles.len()];
        for (&[a, b], &(one, c)) in &sides {
            let Some(&(other, d)) = sides.get(&[b, a]) else { continue };
            let opposite = angle(mesh, c, [a, b]) + angle(mesh, d, [a, b]);
            if a < b && opposite > PI + 1e-9 && !is_turned[one] && !is_turned[other] {
                (mesh.triangles[one], mesh.triangles[other]) = ([a, d, c], [d, b, c]);
                (is_turned[one], is_turned[other]) = (true, true);
            }
        }
        if !is_turned.contains(&true) {
            break;
        }
    }
}

/// The angle (rad) at a point between the ways to two others.
fn angle(mesh: &TriangleMesh, at: u32, [one, other]: [u32; 2]) -> f64 {
    let [at, one, other] = [at, one, other].map(|point| mesh.points[point as usize]);
    let (first, second) = (minus(one, at), minus(other, at));
    length(cross(first, second)).atan2(dot(first, second))
}
