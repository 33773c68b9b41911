//! A closed surface as it is drawn: round where its triangles meet flatly, with an edge where they do not.
//!
//! Enters: points (m), triangles turned outwards. Leaves: corners with unit normals, and triangles over them, a
//! little within the solid.

use crate::{
    geometry::{Bounds, along, cross, dot, length, minus, unit},
    sdk::Mesh3D,
};

/// Cosine of the angle (40 degrees) from which on there is an edge between two triangles.
const CREASE: f32 = 0.766_044_4;
/// The drawn surface lies this far within the solid, over half of its smallest extent: between particles that lie
/// on a surface, a triangle of cloth passes below it.
const INSET: f32 = 0.015;
/// And no farther than this share of the shortest edge at a point: a thin part stays, and is not turned inside out.
const OF_EDGE: f32 = 0.25;
/// A point of more triangles is round: it has one normal.
const MOST_TRIANGLES: usize = 64;

/// A closed surface as it is drawn.
#[derive(Debug)]
pub(crate) struct Facets {
    /// The box around all triangles (m).
    pub(crate) bounds: Bounds,
    /// Where each corner is (m).
    positions: Vec<[f32; 3]>,
    /// The unit normal at each corner.
    normals: Vec<[f32; 3]>,
    /// Three corners each.
    triangles: Vec<[u32; 3]>,
}

impl Facets {
    /// The drawn surface of a solid.
    pub(crate) fn of(points: &[[f32; 3]], triangles: &[[u32; 3]]) -> Self {
        let named = triangles.as_flattened();
        let mut bounds = Bounds::empty();
        for &point in named {
            bounds.add(points[point as usize]);
        }

        let faces = Faces::of(points, triangles);
        let mut drawn =
            Self { bounds, positions: Vec::new(), normals: Vec::new(), triangles: triangles.to_vec() };
        let mut corners: Vec<usize> = (0..named.len()).collect();
        corners.sort_by_key(|&corner| named[corner]);
        for corners in corners.chunk_by(|&a, &b| named[a] == named[b]) {
            drawn.add(points[named[corners[0]] as usize], corners, &faces);
        }
        drawn
    }

    /// A mesh around the middle of its box.
    pub(crate) fn mesh(self) -> Mesh3D {
        let center = self.bounds.center();
        Mesh3D::new(self.positions.into_iter().map(|at| minus(at, center)))
            .with_vertex_normals(self.normals)
            .with_triangle_indices(self.triangles)
    }

    /// Adds a point: as many corners there as its triangles have normals.
    fn add(&mut self, point: [f32; 3], corners: &[usize], faces: &Faces) {
        let round = faces.normal(corners, |_| true).unwrap_or([0.0, 1.0, 0.0]);
        let edge = corners.iter().map(|&corner| faces.edges[corner]).fold(f32::INFINITY, f32::min);
        let inset = (INSET * self.bounds.half_width()).min(OF_EDGE * edge);
        let first = self.normals.len();
        for &corner in corners {
            let own = faces.normals[corner / 3];
            let normal = if corners.len() > MOST_TRIANGLES {
                round
            } else {
                faces.normal(corners, |other| dot(own, other) > CREASE).unwrap_or(round)
            };
            let same = self.normals[first..].iter().position(|known| *known == normal);
            let index = same.map_or(self.normals.len(), |place| first + place);
            if same.is_none() {
                self.positions.push(along(point, -inset, round));
                self.normals.push(normal);
            }
            self.triangles[corner / 3][corner % 3] = index as u32;
        }
    }
}

/// What is known of each triangle and of each of its corners, which are counted over all triangles.
struct Faces {
    /// Unit normal of a triangle; 0 if it has no area.
    normals: Vec<[f32; 3]>,
    /// Angle at a corner (rad).
    angles: Vec<f32>,
    /// Length of the edge that begins at a corner (m).
    edges: Vec<f32>,
}

impl Faces {
    fn of(points: &[[f32; 3]], triangles: &[[u32; 3]]) -> Self {
        let mut faces = Self { normals: Vec::new(), angles: Vec::new(), edges: Vec::new() };
        for triangle in triangles {
            let at = triangle.map(|index| points[index as usize]);
            for corner in 0..3 {
                let [ahead, back] = [1, 2].map(|step| minus(at[(corner + step) % 3], at[corner]));
                faces.angles.push(length(cross(ahead, back)).atan2(dot(ahead, back)));
                faces.edges.push(length(ahead));
            }
            let normal = cross(minus(at[1], at[0]), minus(at[2], at[0]));
            faces.normals.push(unit(normal).unwrap_or_default());
        }
        faces
    }

    /// Unit sum of the normals of those triangles that count, each weighted by its angle there (Baerentzen and
    /// Aanaes 2005).
    fn normal(&self, corners: &[usize], counts: impl Fn([f32; 3]) -> bool) -> Option<[f32; 3]> {
        let mut sum = [0.0; 3];
        for &corner in corners {
            let normal = self.normals[corner / 3];
            if counts(normal) {
                sum = along(sum, self.angles[corner], normal);
            }
        }
        unit(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box of 12 triangles around the origin.
    fn cuboid(half: [f32; 3]) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let corner =
            |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { half[axis] } else { -half[axis] });
        let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = sides.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        ((0..8).map(corner).collect(), triangles)
    }

    /// A ring around the y axis, of a radius of 0.5 m, made of a tube of 0.2 m.
    fn ring(around: u32, across: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let turn = |i: u32, of: u32| (std::f32::consts::TAU * i as f32 / of as f32).sin_cos();
        let (mut points, mut triangles) = (Vec::new(), Vec::new());
        for i in 0..around {
            for j in 0..across {
                let ((sin, cos), (up, out)) = (turn(i, around), turn(j, across));
                let far = 0.5 + 0.2 * out;
                points.push([far * cos, 0.2 * up, far * sin]);
                let [a, b] = [j, (j + 1) % across].map(|j| i * across + j);
                let [c, d] = [a, b].map(|index| (index + across) % (around * across));
                triangles.extend([[a, b, c], [b, d, c]]);
            }
        }
        (points, triangles)
    }

    #[test]
    fn a_box_has_six_flat_sides_a_little_within_the_solid() {
        let half = [2.0, 1.0, 3.0];
        let (points, triangles) = cuboid(half);
        let drawn = Facets::of(&points, &triangles);
        assert_eq!((drawn.positions.len(), drawn.normals.len()), (24, 24), "three normals at each corner");
        for (at, normal) in drawn.positions.iter().zip(&drawn.normals) {
            let mut sizes = normal.map(f32::abs);
            sizes.sort_by(f32::total_cmp);
            assert_eq!(sizes, [0.0, 0.0, 1.0]);
            for axis in 0..3 {
                let inside = half[axis] - at[axis].abs();
                assert!(inside > 0.0 && inside <= 0.015, "{at:?}");
            }
        }
    }

    #[test]
    fn a_ring_is_round_and_its_triangles_keep_their_side() {
        let (points, triangles) = ring(48, 24);
        let drawn = Facets::of(&points, &triangles);
        assert_eq!(drawn.positions.len(), points.len(), "a normal at each point");
        for (at, normal) in drawn.positions.iter().zip(&drawn.normals) {
            let far = at[0].hypot(at[2]);
            let from_tube = [at[0] * (1.0 - 0.5 / far), at[1], at[2] * (1.0 - 0.5 / far)];
            assert!((length(from_tube) - 0.2 * (1.0 - INSET)).abs() < 1e-4, "{at:?}");
            assert!(dot(from_tube, *normal) > 0.999 * length(from_tube), "{normal:?}");
        }
        for triangle in &drawn.triangles {
            let [a, b, c] = triangle.map(|index| drawn.positions[index as usize]);
            let normal = cross(minus(b, a), minus(c, a));
            assert!(dot(normal, drawn.normals[triangle[0] as usize]) > 0.9 * length(normal));
        }
    }

    #[test]
    fn a_thin_part_is_not_turned_inside_out() {
        let (mut points, mut triangles) = cuboid([1.0; 3]);
        let (needle, sides) = cuboid([5e-4, 2.0, 5e-4]);
        points.extend(&needle);
        triangles.extend(sides.iter().map(|side| side.map(|index| index + 8)));
        let drawn = Facets::of(&points, &triangles);
        for (side, made) in triangles.iter().zip(&drawn.triangles).skip(12) {
            for (&point, &corner) in side.iter().zip(made) {
                let (exact, at) = (points[point as usize], drawn.positions[corner as usize]);
                assert!(exact[0] * at[0] > 0.0 && exact[2] * at[2] > 0.0, "{at:?}");
            }
        }
    }

    #[test]
    fn points_of_no_triangle_do_not_count_and_a_triangle_of_no_area_does_no_harm() {
        let (mut points, mut triangles) = cuboid([1.0; 3]);
        points.push([1000.0; 3]);
        triangles.push([0, 0, 1]);
        let drawn = Facets::of(&points, &triangles);
        assert_eq!(drawn.bounds.corners()[7], [1.0; 3]);
        let mut numbers = drawn.positions.iter().chain(&drawn.normals).flatten();
        assert!(numbers.all(|number| number.is_finite()));
    }
}
