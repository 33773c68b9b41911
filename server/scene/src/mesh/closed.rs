//! Closed triangle meshes: whether a mesh encloses a solid, and the solid's volume and centre.
//!
//! Reads a mesh; writes its triangles without points twice at one position, or says which edge
//! is open. Snow fills such solids, and colliders are such solids. A mesh is closed when each edge
//! has two triangles that run along it in opposite directions. Points with the same coordinates
//! count as one, so that seams of texture are no gaps.

use std::fmt;

use nappe_sim::{
    interrupt,
    math::number,
    mesh::{Groups, TriangleMesh},
};

use super::{
    numbers::to_six_digits,
    parts::{Part, parts, tetrahedron},
};

/// The surface of a solid.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Closed {
    pub(crate) points: Vec<[f64; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Volume (m³) by the divergence theorem, above 0.
    pub(crate) volume: f64,
    /// Centre of mass (m).
    pub(crate) center: [f64; 3],
    /// Its parts, which no edge joins.
    pub(crate) parts: Vec<Part>,
    /// The part of each triangle.
    pub(crate) part_of: Vec<u32>,
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
    /// A hole with too many edges to be filled, and the first of its points.
    LongHole { edges: usize, allowed: usize, point: u32, position: [f64; 3] },
    /// It encloses no volume.
    Flat,
    /// One of its parts encloses no volume: the one of this triangle.
    FlatPart { triangle: u32 },
    /// It is too much work to tell which of its parts are holes.
    Crowded(String),
}

impl fmt::Display for NotClosed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let near = |v: [f64; 3]| v.map(|c| number(to_six_digits(c))).join(", ");
        match self {
            Self::Empty => f.write_str("has no triangles with an area: only a closed surface has an inside"),
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
            Self::LongHole { edges, allowed, point, position } => write!(
                f,
                "has a hole of {edges} open edges, which begins at point {point} at ({}); holes of at most {allowed} edges are closed",
                near(*position)
            ),
            Self::Flat => f.write_str("encloses no volume"),
            Self::FlatPart { triangle } => {
                write!(f, "has a part that encloses no volume: that of triangle {triangle}")
            }
            Self::Crowded(why) => f.write_str(why),
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

/// A triangle by its corners, with its number in the file.
pub(super) type Numbered = (u32, [u32; 3]);

/// One side of a triangle: its ends in ascending order, whether it runs that way, the triangle's place among those looked at.
pub(super) type Side = ([u32; 2], bool, u32);

impl Closed {
    /// The solid that a mesh encloses.
    pub(crate) fn new(mesh: &TriangleMesh) -> Result<Self, NotClosed> {
        Self::of(&mesh.points, whole_triangles(mesh))
    }

    /// The solid that triangles enclose whose corners are the first of the points at each place.
    pub(super) fn of(points: &[[f64; 3]], kept: Vec<Numbered>) -> Result<Self, NotClosed> {
        let joined = check_closed(&kept, points)?;
        let (part_of, parts) = parts(points, &kept, joined);
        let triangles: Vec<[u32; 3]> = kept.into_iter().map(|(_, t)| t).collect();
        let (volume, center) = moments(points, &triangles).ok_or(NotClosed::Flat)?;
        Ok(Self { points: points.to_vec(), triangles, volume: volume.abs(), center, parts, part_of })
    }

    /// Takes a volume (m³) with its first moment (m⁴) off, which was counted too often.
    pub(crate) fn take_off(&mut self, volume: f64, moment: [f64; 3]) {
        let left = self.volume - volume;
        if left > 0.0 {
            self.center = [0, 1, 2].map(|c| (self.volume * self.center[c] - moment[c]) / left);
            self.volume = left;
        }
    }

    /// Lower and upper corner of the box around the triangles (m).
    pub(crate) fn bounds(&self) -> [[f64; 3]; 2] {
        let corners = self.triangles.iter().flatten().map(|i| self.points[*i as usize]);
        corners.fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], p| {
            [[0, 1, 2].map(|c| low[c].min(p[c])), [0, 1, 2].map(|c| high[c].max(p[c]))]
        })
    }
}

/// The triangles of a mesh by the first of the points at each place; those that name one twice are left out.
pub(super) fn whole_triangles(mesh: &TriangleMesh) -> Vec<Numbered> {
    whole_triangles_of(mesh, &vec![0; mesh.points.len()])
}

/// The same where points of different pieces stay apart, also at one place: triangles are of a piece if points join them.
pub(super) fn whole_triangles_of_pieces(mesh: &TriangleMesh) -> Vec<Numbered> {
    let mut joined = Groups::new(mesh.points.len());
    for [a, b, c] in &mesh.triangles {
        joined.join([*a, *b]);
        joined.join([*b, *c]);
    }
    let pieces: Vec<u32> = (0_u32..).take(mesh.points.len()).map(|point| joined.first(point)).collect();
    whole_triangles_of(mesh, &pieces)
}

/// The same where points of different pieces stay apart; `pieces` says the piece of each point.
fn whole_triangles_of(mesh: &TriangleMesh, pieces: &[u32]) -> Vec<Numbered> {
    let same = welded(&mesh.points, pieces);
    let corners = |t: &[u32; 3]| t.map(|i| same[i as usize]);
    let whole = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    (0u32..).zip(mesh.triangles.iter().map(corners)).filter(|(_, t)| whole(t)).collect()
}

/// For each point the first point of its piece with the same coordinates.
fn welded(points: &[[f64; 3]], pieces: &[u32]) -> Vec<u32> {
    // Adding 0 makes one zero of both.
    let key = |i: &u32| {
        interrupt::point();
        (pieces[*i as usize], points[*i as usize].map(|c| (c + 0.0).to_bits()))
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

/// Checks that there are triangles, and that each edge has two that run along it in opposite directions; gives the groups of those
/// that share one.
pub(super) fn check_closed(triangles: &[Numbered], points: &[[f64; 3]]) -> Result<Groups, NotClosed> {
    if triangles.is_empty() {
        return Err(NotClosed::Empty);
    }
    let sides = sides(triangles);
    check_sides(&sides, triangles, points, |count| count == 2)?;
    let mut joined = Groups::new(triangles.len());
    sides.chunk_by(|a, b| a.0 == b.0).for_each(|edge| joined.join([edge[0].2, edge[1].2]));
    Ok(joined)
}

/// The sides of triangles, those of one edge beside each other.
pub(super) fn sides(triangles: &[Numbered]) -> Vec<Side> {
    let side = |t: u32, from: u32, to: u32| -> Side { ([from.min(to), from.max(to)], from < to, t) };
    let of_one = |(t, &(_, [a, b, c])): (u32, &Numbered)| [side(t, a, b), side(t, b, c), side(t, c, a)];
    let mut sides: Vec<Side> = (0u32..).zip(triangles).flat_map(of_one).collect();
    interrupt::point();
    sides.sort_unstable();
    interrupt::point();
    sides
}

/// Checks that each edge has a number of triangles that is allowed, and that two run along it in opposite directions.
pub(super) fn check_sides(
    sides: &[Side],
    triangles: &[Numbered],
    points: &[[f64; 3]],
    is_allowed: impl Fn(usize) -> bool,
) -> Result<(), NotClosed> {
    let positions = |edge: [u32; 2]| edge.map(|i| points[i as usize]);
    let edges = || sides.chunk_by(|a, b| a.0 == b.0);
    let mut odd = edges().filter(|edge| !is_allowed(edge.len()));
    if let Some(first) = odd.next() {
        let (points, others) = (first[0].0, odd.count());
        return Err(NotClosed::Edge { points, positions: positions(points), triangles: first.len(), others });
    }
    match edges().find(|edge| edge.len() == 2 && edge[0].1 == edge[1].1) {
        Some(turned) => Err(NotClosed::Turned {
            triangles: [0, 1].map(|side| triangles[turned[side].2 as usize].0),
            positions: positions(turned[0].0),
        }),
        None => Ok(()),
    }
}

/// Volume and centre of mass by the divergence theorem: a tetrahedron for each triangle, with its
/// apex at a point of the mesh, so that meshes far from the origin lose no digits. The volume of a
/// mesh that is turned inside out is below 0.
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
    Some((six_volumes / 6.0, [0, 1, 2].map(|k| apex[k] + moment[k] / six_volumes)))
}
