//! Normals of a closed surface: of its triangles, and pseudonormals of its edges and corners, which tell its sides.
//!
//! Reads points (m) and triangles turned outwards; writes unit vectors. J. A. Baerentzen and H. Aanaes, "Signed distance
//! computation using the angle weighted pseudonormal", IEEE TVCG 11 (2005): where the nearest point of a closed surface
//! lies on an edge or a corner, a point is outside if and only if the way to it has no negative share of the pseudonormal
//! there, the sum of the normals around it, each by the angle of its triangle.

use crate::{
    math::array::{cross, dot, length, minus},
    mesh::Groups,
};

/// The normals of a surface.
#[derive(Clone, Debug)]
pub(super) struct Normals {
    /// Of each triangle; zero where it has no area.
    pub(super) faces: Vec<[f64; 3]>,
    /// Of the edges of each triangle: from its first corner to its second, and so on.
    pub(super) edges: Vec<[[f64; 3]; 3]>,
    /// Of each point; zero where no triangle has it as a corner.
    pub(super) corners: Vec<[f64; 3]>,
}

/// One side of a triangle: its ends in ascending order, whether it runs that way, its triangle, its place there.
type Side = ([u32; 2], bool, u32, usize);

impl Normals {
    /// Those of a surface, and its triangles in groups that edges join.
    ///
    /// # Errors
    /// When an edge has not exactly two triangles that run along it in opposite directions.
    pub(super) fn new(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<(Self, Groups), String> {
        let mut corners = vec![[0.0; 3]; points.len()];
        let mut faces = Vec::with_capacity(triangles.len());
        for triangle in triangles {
            let [a, b, c] = triangle.map(|i| points[i as usize]);
            let normal = unit(cross(minus(b, a), minus(c, a)));
            faces.push(normal);
            for (k, [here, next, last]) in [[a, b, c], [b, c, a], [c, a, b]].into_iter().enumerate() {
                let (u, v) = (minus(next, here), minus(last, here));
                let angle = libm::atan2(length(cross(u, v)), dot(u, v));
                let sum = &mut corners[triangle[k] as usize];
                *sum = [0, 1, 2].map(|c| sum[c] + angle * normal[c]);
            }
        }

        let mut edges = vec![[[0.0; 3]; 3]; triangles.len()];
        let mut joined = Groups::new(triangles.len());
        for [(_, _, t, k), (_, _, other, place)] in pairs_of_sides(triangles)? {
            let [n, m] = [t, other].map(|t| faces[t as usize]);
            let normal = unit([0, 1, 2].map(|c| n[c] + m[c]));
            edges[t as usize][k] = normal;
            edges[other as usize][place] = normal;
            joined.join([t, other]);
        }
        Ok((Self { faces, edges, corners: corners.into_iter().map(unit).collect() }, joined))
    }
}

/// The two sides of each edge.
fn pairs_of_sides(triangles: &[[u32; 3]]) -> Result<Vec<[Side; 2]>, String> {
    let side =
        |t: u32, k: usize, [from, to]: [u32; 2]| -> Side { ([from.min(to), from.max(to)], from < to, t, k) };
    let of_one =
        |(t, &[a, b, c]): (u32, &[u32; 3])| [side(t, 0, [a, b]), side(t, 1, [b, c]), side(t, 2, [c, a])];
    let mut sides: Vec<Side> = (0_u32..).zip(triangles).flat_map(of_one).collect();
    sides.sort_unstable();
    let pair = |edge: &[Side]| match edge {
        &[first, second] if first.1 != second.1 => Ok([first, second]),
        _ => {
            let ([from, to], count) = (edge[0].0, edge.len());
            Err(format!(
                "{count} triangles have the edge from point {from} to point {to}: two that run along it in opposite \
                 directions are needed"
            ))
        }
    };
    sides.chunk_by(|a, b| a.0 == b.0).map(pair).collect()
}

/// A vector divided by its length; zero where it has none.
fn unit(v: [f64; 3]) -> [f64; 3] {
    // What is too short or too long to be squared is brought near 1 first.
    let size = v.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
    if size == 0.0 || !size.is_finite() {
        return [0.0; 3];
    }
    let v = v.map(|c| c / size);
    let length = length(v);
    v.map(|c| c / length)
}
