//! Which way the threads of a fabric run: the direction of the warp in each triangle at rest.
//!
//! Reads a mesh; gives a unit vector in the plane of each triangle, from texture coordinates or from one direction for all, or
//! says where there is none.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{
    interrupt,
    math::array::{cross, dot, length, minus},
    mesh::TriangleMesh,
};

/// Least sine of the angle between a direction and the normal of a triangle into which it is projected: that of 30 degrees.
const LEAST: f64 = 0.5;
/// Least area in texture coordinates, in the product of two sides.
const FLAT: f64 = 1e-9;

/// Where the warp of a fabric runs, at rest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Warp {
    /// The way the first texture coordinate grows where the second one stays.
    Uv,
    /// Along a vector, projected into each triangle. Where that is within 30 degrees of the normal, the direction of a
    /// neighbour is carried over, as if both lay in one plane.
    Along([f64; 3]),
}

/// The threads of a fabric.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Threads {
    /// Where the warp runs; the weft runs across it.
    pub warp: Warp,
    /// Stiffness along the warp, along the weft and against shear, in that of the law (1).
    pub shares: [f64; 3],
}

impl Default for Threads {
    /// The warp along x, and all of it as stiff.
    fn default() -> Self {
        Self { warp: Warp::Along([1.0, 0.0, 0.0]), shares: [1.0; 3] }
    }
}

/// Why the warp has no direction in a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum WarpError {
    #[error("the mesh has no texture coordinates")]
    NoUv,
    #[error("the triangle of points {} has no area in texture coordinates", named(*corners))]
    FlatUv { corners: [u32; 3] },
    #[error(
        "it is within 30 degrees of the normal of the triangle of points {}, and of those of all triangles that it hangs together \
         with",
        named(*corners)
    )]
    AlongNormals { corners: [u32; 3] },
}

fn named([a, b, c]: [u32; 3]) -> String {
    format!("{a}, {b} and {c}")
}

/// Directions of the warp.
pub(super) struct Directions {
    /// Of each triangle; none where it has no area, or the warp no direction.
    pub(super) of_triangles: Vec<Option<[f64; 3]>>,
    /// Why the first triangle with an area has none.
    pub(super) missing: Option<WarpError>,
}

/// Why the warp has no direction in a triangle of a mesh at rest; none where it has one in all.
pub(crate) fn no_warp(mesh: &TriangleMesh, warp: Warp) -> Option<WarpError> {
    directions(mesh, &mesh.each_once(), warp).missing
}

/// The direction of the warp in triangles of a mesh at rest, each of them there once.
pub(super) fn directions(mesh: &TriangleMesh, triangles: &[[u32; 3]], warp: Warp) -> Directions {
    let mut of_triangles: Vec<Option<[f64; 3]>> = match warp {
        Warp::Uv => triangles.iter().map(|corners| by_uv(mesh, *corners)).collect(),
        Warp::Along(vector) => triangles.iter().map(|corners| along(mesh, *corners, vector)).collect(),
    };
    if matches!(warp, Warp::Along(_)) && of_triangles.contains(&None) {
        carry_over(mesh, triangles, &mut of_triangles);
    }

    let is_missing = |(corners, direction): &(&[u32; 3], &Option<[f64; 3]>)| {
        direction.is_none() && normal(mesh, **corners).is_some()
    };
    let missing = triangles.iter().zip(&of_triangles).find(is_missing).map(|(corners, _)| match warp {
        Warp::Uv if mesh.uv.is_empty() => WarpError::NoUv,
        Warp::Uv => WarpError::FlatUv { corners: *corners },
        Warp::Along(_) => WarpError::AlongNormals { corners: *corners },
    });
    Directions { of_triangles, missing }
}

/// A vector of length 1; none of one that has no direction.
fn unit(vector: [f64; 3]) -> Option<[f64; 3]> {
    let size = length(vector);
    (size > 0.0 && size.is_finite()).then(|| vector.map(|c| c / size))
}

/// The normal of a triangle; none without an area.
fn normal(mesh: &TriangleMesh, corners: [u32; 3]) -> Option<[f64; 3]> {
    let [a, b, c] = corners.map(|corner| mesh.points[corner as usize]);
    unit(cross(minus(b, a), minus(c, a)))
}

fn by_uv(mesh: &TriangleMesh, corners: [u32; 3]) -> Option<[f64; 3]> {
    interrupt::point();
    normal(mesh, corners)?;
    let [a, b, c] = corners.map(|corner| mesh.points[corner as usize]);
    let [Some(at_a), Some(at_b), Some(at_c)] = corners.map(|corner| mesh.uv.get(corner as usize)) else {
        return None;
    };
    let [p, q] = [at_b, at_c].map(|at| [at[0] - at_a[0], at[1] - at_a[1]]);
    let area = p[0] * q[1] - p[1] * q[0];
    if area.is_nan() || area.abs() <= FLAT * p[0].hypot(p[1]) * q[0].hypot(q[1]) {
        return None;
    }
    let (one, other) = (minus(b, a), minus(c, a));
    unit([0, 1, 2].map(|e| (q[1] * one[e] - p[1] * other[e]) / area))
}

fn along(mesh: &TriangleMesh, corners: [u32; 3], vector: [f64; 3]) -> Option<[f64; 3]> {
    interrupt::point();
    let (normal, vector) = (normal(mesh, corners)?, unit(vector)?);
    let height = dot(normal, vector);
    let within = [0, 1, 2].map(|c| vector[c] - height * normal[c]);
    if length(within) < LEAST { None } else { unit(within) }
}

/// A side of a triangle.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    /// Its ends, the smaller one first.
    edge: [u32; 2],
    /// The corner across it.
    opposite: u32,
    triangle: usize,
}

fn sides_of(triangle: usize, [a, b, c]: [u32; 3]) -> [Side; 3] {
    [(a, b, c), (b, c, a), (c, a, b)].map(|(p, q, opposite)| Side {
        edge: [p.min(q), p.max(q)],
        opposite,
        triangle,
    })
}

/// Gives directions to triangles without, ring by ring, from those that have one across an edge.
fn carry_over(mesh: &TriangleMesh, triangles: &[[u32; 3]], of_triangles: &mut [Option<[f64; 3]>]) {
    let mut sides: Vec<Side> =
        triangles.iter().enumerate().flat_map(|(place, corners)| sides_of(place, *corners)).collect();
    sides.sort_unstable();
    let is_known = |place: &usize| of_triangles[*place].is_some();
    let mut known: VecDeque<usize> = (0..triangles.len()).filter(is_known).collect();
    while let Some(from) = known.pop_front() {
        interrupt::point();
        let Some(direction) = of_triangles[from] else { continue };
        for own in sides_of(from, triangles[from]) {
            let first = sides.partition_point(|side| side.edge < own.edge);
            for side in sides[first..].iter().take_while(|side| side.edge == own.edge) {
                if of_triangles[side.triangle].is_some() {
                    continue;
                }
                let [p, q] = own.edge;
                let places = [p, q, own.opposite, side.opposite].map(|point| mesh.points[point as usize]);
                if let Some(carried) = unfold(direction, places) {
                    of_triangles[side.triangle] = Some(carried);
                    known.push_back(side.triangle);
                }
            }
        }
    }
}

/// A direction in one triangle, carried over to the one across an edge from `p` to `q` as if both lay in one plane; `from` and
/// `to` are the corners across the edge. None where the other triangle has no area.
fn unfold(direction: [f64; 3], [p, q, from, to]: [[f64; 3]; 4]) -> Option<[f64; 3]> {
    let edge = unit(minus(q, p))?;
    let away = |corner: [f64; 3]| {
        let way = minus(corner, p);
        let along = dot(way, edge);
        unit([0, 1, 2].map(|c| way[c] - along * edge[c]))
    };
    let (inside, beyond) = (away(from)?, away(to)?);
    let (along, across) = (dot(direction, edge), -dot(direction, inside));
    unit([0, 1, 2].map(|c| along * edge[c] + across * beyond[c]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of squares of side 1, folded upwards by a right angle after each of the first columns.
    fn folded() -> TriangleMesh {
        let profile = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let points = profile.iter().flat_map(|[x, y]| [[*x, *y, 0.0], [*x, *y, 1.0]]).collect();
        let cell = |i: u32| [[2 * i, 2 * i + 1, 2 * i + 2], [2 * i + 1, 2 * i + 3, 2 * i + 2]];
        TriangleMesh { points, triangles: (0..3).flat_map(cell).collect(), ..TriangleMesh::default() }
    }

    /// Whether a direction is that one, or the opposite one, which means the same.
    fn is_near(found: Option<[f64; 3]>, expected: [f64; 3]) -> bool {
        let is_along = |found: [f64; 3]| length(minus(found, expected)) < 1e-14;
        found.is_some_and(|found| is_along(found) || is_along(found.map(|c| -c)))
    }

    #[test]
    fn a_direction_along_a_normal_is_carried_over_a_fold() {
        let mesh = folded();
        let Directions { of_triangles, missing } =
            directions(&mesh, &mesh.triangles, Warp::Along([2.0, 0.0, 0.0]));
        assert_eq!(missing, None);
        // The wall in the middle stands across x: what runs to it goes on upwards.
        let expected = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]];
        for (cell, expected) in of_triangles.chunks(2).zip(expected) {
            assert!(cell.iter().all(|found| is_near(*found, expected)), "{cell:?}, expected {expected:?}");
        }

        // Along the fold it lies in all of them.
        let all = directions(&mesh, &mesh.triangles, Warp::Along([0.0, 0.0, 1.0])).of_triangles;
        assert!(all.into_iter().all(|found| is_near(found, [0.0, 0.0, 1.0])));
    }

    #[test]
    fn a_direction_along_every_normal_is_an_error() {
        let mesh = TriangleMesh::grid(3, 3, 1.0);
        let found = directions(&mesh, &mesh.triangles, Warp::Along([0.1, 1.0, 0.0]));
        let corners = mesh.triangles[0];
        assert_eq!(found.missing, Some(WarpError::AlongNormals { corners }));
        assert!(found.of_triangles.iter().all(Option::is_none));
    }

    #[test]
    fn texture_coordinates_tell_the_warp_or_which_triangle_has_none() {
        let mut mesh = folded();
        let by_uv = |mesh: &TriangleMesh| directions(mesh, &mesh.triangles, Warp::Uv);
        assert_eq!(by_uv(&mesh).missing, Some(WarpError::NoUv));

        // The first coordinate runs along the strip, over the folds, and askew.
        let uv = |i: usize| [3.0 * (i / 2) as f64, (i % 2) as f64 + 3.0 * (i / 2) as f64];
        mesh.uv = (0..8).map(uv).collect();
        let Directions { of_triangles, missing } = by_uv(&mesh);
        assert_eq!(missing, None);
        // Where the second coordinate stays, a step of 1 along the strip goes 3 back across it.
        let slope = [1.0, -3.0].map(|c| c / 10.0_f64.sqrt());
        assert!(is_near(of_triangles[0], [slope[0], 0.0, slope[1]]), "{:?}", of_triangles[0]);
        assert!(is_near(of_triangles[2], [0.0, slope[0], slope[1]]), "{:?}", of_triangles[2]);

        mesh.uv[5] = mesh.uv[4];
        assert_eq!(by_uv(&mesh).missing, Some(WarpError::FlatUv { corners: mesh.triangles[3] }));
    }

    #[test]
    fn triangles_without_an_area_have_no_direction_and_are_no_error() {
        let mut mesh = TriangleMesh::grid(3, 2, 1.0);
        mesh.points[2] = mesh.points[1];
        let found = directions(&mesh, &mesh.triangles, Warp::Along([1.0, 0.0, 0.0]));
        assert_eq!(found.missing, None);
        assert_eq!(found.of_triangles.iter().filter(|direction| direction.is_none()).count(), 1);
    }
}
