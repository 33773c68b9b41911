//! Closed triangle meshes: whether a mesh encloses a solid, and the solid's volume and centre.
//!
//! Reads a mesh; writes its triangles without points twice at one position, or says which edge
//! is open. A mesh is closed when each edge has two triangles that run along it in opposite
//! directions. Points with the same coordinates count as one, so that seams of texture are no gaps.

use std::fmt;

use nappe_sim::{
    interrupt,
    math::number,
    mesh::{Groups, TriangleMesh},
};

use super::parts::{Part, parts, tetrahedron};
use crate::mesh::to_six_digits;

/// The surface of a solid.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Closed {
    pub(super) points: Vec<[f64; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Volume (m³) by the divergence theorem, above 0.
    pub(super) volume: f64,
    /// Centre of mass (m).
    pub(super) center: [f64; 3],
    /// Its parts, which no edge joins.
    pub(super) parts: Vec<Part>,
    /// The part of each triangle.
    pub(super) part_of: Vec<u32>,
}

/// Why a mesh encloses no solid.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum NotClosed {
    /// It has no triangles with an area.
    Empty,
    /// An edge with another number of triangles than two.
    Edge { points: [u32; 2], positions: [[f64; 3]; 2], triangles: usize, others: usize },
    /// Two triangles run along an edge in the same direction.
    Turned { triangles: [u32; 2], positions: [[f64; 3]; 2] },
    /// It encloses no volume.
    Flat,
}

impl fmt::Display for NotClosed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let near = |v: [f64; 3]| v.map(|c| number(to_six_digits(c))).join(", ");
        match self {
            Self::Empty => f.write_str("has no triangles: only the inside of a closed surface can be filled"),
            Self::Edge { points: [a, b], positions: [p, q], triangles, others } => {
                let plural = if *triangles == 1 { "" } else { "s" };
                write!(
                    f,
                    "is not closed: the edge from point {a} at ({}) to point {b} at ({}) has {triangles} triangle{plural}, and each edge of a closed surface has two",
                    near(*p),
                    near(*q)
                )?;
                match others {
                    0 => Ok(()),
                    1 => f.write_str("; 1 other edge is open too"),
                    _ => write!(f, "; {others} other edges are open too"),
                }
            }
            Self::Turned { triangles: [a, b], positions: [p, q] } => write!(
                f,
                "has triangles {a} and {b} that run along their edge from ({}) to ({}) in the same direction: one of them is inside out",
                near(*p),
                near(*q)
            ),
            Self::Flat => f.write_str("encloses no volume"),
        }
    }
}

/// The volume (m³) that a mesh encloses. Points with the same coordinates count as one.
///
/// # Errors
/// Why it encloses none, in words that go on after "the mesh".
pub fn enclosed_volume(mesh: &TriangleMesh) -> Result<f64, String> {
    Closed::new(mesh).map(|closed| closed.volume).map_err(|error| error.to_string())
}

/// One side of a triangle: its ends in ascending order, whether it runs that way, the triangle's place among those looked at.
type Side = ([u32; 2], bool, u32);

impl Closed {
    /// The solid that a mesh encloses.
    pub(crate) fn new(mesh: &TriangleMesh) -> Result<Self, NotClosed> {
        let same = welded(&mesh.points);
        let corners = |t: &[u32; 3]| t.map(|i| same[i as usize]);
        let whole = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        let kept: Vec<(u32, [u32; 3])> =
            (0u32..).zip(mesh.triangles.iter().map(corners)).filter(|(_, t)| whole(t)).collect();
        if kept.is_empty() {
            return Err(NotClosed::Empty);
        }
        let joined = check_edges(&kept, &mesh.points)?;
        let (part_of, parts) = parts(&mesh.points, &kept, joined);
        let triangles: Vec<[u32; 3]> = kept.into_iter().map(|(_, t)| t).collect();
        let (volume, center) = moments(&mesh.points, &triangles).ok_or(NotClosed::Flat)?;
        Ok(Self { points: mesh.points.clone(), triangles, volume, center, parts, part_of })
    }

    /// Takes a volume (m³) with its first moment (m⁴) off, which was counted too often.
    pub(super) fn take_off(&mut self, volume: f64, moment: [f64; 3]) {
        let left = self.volume - volume;
        if left > 0.0 {
            self.center = [0, 1, 2].map(|c| (self.volume * self.center[c] - moment[c]) / left);
            self.volume = left;
        }
    }

    /// Lower and upper corner of the box around the triangles (m).
    pub(super) fn bounds(&self) -> [[f64; 3]; 2] {
        let corners = self.triangles.iter().flatten().map(|i| self.points[*i as usize]);
        corners.fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], p| {
            [[0, 1, 2].map(|c| low[c].min(p[c])), [0, 1, 2].map(|c| high[c].max(p[c]))]
        })
    }
}

/// For each point the first point of the mesh with the same coordinates.
fn welded(points: &[[f64; 3]]) -> Vec<u32> {
    // Adding 0 makes one zero of both.
    let key = |i: &u32| {
        interrupt::point();
        points[*i as usize].map(|c| (c + 0.0).to_bits())
    };
    let mut order: Vec<u32> = (0u32..).take(points.len()).collect();
    order.sort_unstable_by_key(|i| (key(i), *i));
    let mut same = vec![0; points.len()];
    for group in order.chunk_by(|a, b| key(a) == key(b)) {
        for i in group {
            same[*i as usize] = group[0];
        }
    }
    same
}

/// Checks that each edge has two triangles that run along it in opposite directions; gives the groups of those that share one.
fn check_edges(triangles: &[(u32, [u32; 3])], points: &[[f64; 3]]) -> Result<Groups, NotClosed> {
    let side = |t: u32, from: u32, to: u32| -> Side { ([from.min(to), from.max(to)], from < to, t) };
    let of_one =
        |(t, &(_, [a, b, c])): (u32, &(u32, [u32; 3]))| [side(t, a, b), side(t, b, c), side(t, c, a)];
    let mut sides: Vec<Side> = (0u32..).zip(triangles).flat_map(of_one).collect();
    interrupt::point();
    sides.sort_unstable();
    interrupt::point();
    let positions = |edge: [u32; 2]| edge.map(|i| points[i as usize]);
    let edges = || sides.chunk_by(|a, b| a.0 == b.0);
    let mut open = edges().filter(|edge| edge.len() != 2);
    if let Some(first) = open.next() {
        let (points, others) = (first[0].0, open.count());
        return Err(NotClosed::Edge { points, positions: positions(points), triangles: first.len(), others });
    }

    if let Some(turned) = edges().find(|edge| edge[0].1 == edge[1].1) {
        Err(NotClosed::Turned {
            triangles: [0, 1].map(|side| triangles[turned[side].2 as usize].0),
            positions: positions(turned[0].0),
        })
    } else {
        let mut joined = Groups::new(triangles.len());
        edges().for_each(|edge| joined.join([edge[0].2, edge[1].2]));
        Ok(joined)
    }
}

/// Volume and centre of mass by the divergence theorem: a tetrahedron for each triangle, with its
/// apex at a point of the mesh, so that meshes far from the origin lose no digits.
fn moments(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Option<(f64, [f64; 3])> {
    let apex = points[triangles[0][0] as usize];
    let (mut six_volumes, mut size, mut moment) = (0.0_f64, 0.0_f64, [0.0; 3]);
    for corners in triangles {
        let [a, b, c] = corners.map(|i| [0, 1, 2].map(|k| points[i as usize][k] - apex[k]));
        let six = tetrahedron([a, b, c]);
        six_volumes += six;
        size += six.abs();
        for k in 0..3 {
            moment[k] += six * (a[k] + b[k] + c[k]) / 4.0;
        }
    }

    // What rounding leaves of a flat surface is no volume.
    if !six_volumes.is_finite() || six_volumes.abs() <= 1e-12 * size {
        return None;
    }
    Some((six_volumes.abs() / 6.0, [0, 1, 2].map(|k| apex[k] + moment[k] / six_volumes)))
}
