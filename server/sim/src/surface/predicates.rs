//! Whether an edge crosses a triangle, and how a ray does, without an error of rounding.
//!
//! Reads places (m); signs of determinants are those of exact arithmetic (J. R. Shewchuk, "Adaptive Precision Floating-Point
//! Arithmetic and Fast Robust Geometric Predicates", 1997), unless numbers underflow: lengths of 1e-90 m are too short.

use robust::{Coord, Coord3D, orient2d, orient3d};

use crate::math::Vec3;

/// Whether an edge goes through a triangle: its ends lie on the two sides of the plane, neither upon it, and the way between
/// them meets the triangle, its border included.
///
/// So an edge that goes through the seam of two triangles crosses both, and nothing passes between them. An edge that ends on
/// the triangle touches it, and so does one that lies in its plane. A triangle without area is crossed by nothing. Places are
/// finite.
pub fn crosses(edge: [Vec3<f64>; 2], triangle: [Vec3<f64>; 3]) -> bool {
    let [above, below] = sides(edge, triangle);
    let is_divided = (above > 0.0 && below < 0.0) || (above < 0.0 && below > 0.0);
    is_divided && meets(edge, triangle)
}

/// Whether an edge goes through a triangle, or ends on it. One that lies in its plane does neither.
pub(crate) fn comes_to(edge: [Vec3<f64>; 2], triangle: [Vec3<f64>; 3]) -> bool {
    let [above, below] = sides(edge, triangle);
    let is_beside = (above > 0.0 && below > 0.0) || (above < 0.0 && below < 0.0);
    let is_within = above == 0.0 && below == 0.0;
    !is_beside && !is_within && meets(edge, triangle)
}

/// Whether the ray from a point (m) along +z goes through a triangle: 1 if its corners turn to the left as they are seen from
/// above, -1 if they turn to the right, and 0 if it does not.
///
/// The ray is moved by an infinitesimal step along x and a smaller one along y, so that it meets no edge and no corner. The sum
/// over a closed surface is how often this goes round the point. Upright triangles are met by no ray.
pub(crate) fn turn_above(point: [f64; 3], corners: [[f64; 3]; 3]) -> i32 {
    let flat = |[x, y, _]: [f64; 3]| Coord { x, y };
    let [a, b, c] = corners.map(flat);
    let turn = sign(orient2d(a, b, c));
    let is_beside = |from: Coord<f64>, to: Coord<f64>| {
        // The derivatives of the side by the point's x and y break ties.
        let by = [orient2d(from, to, flat(point)), from.y - to.y, to.x - from.x];
        by.into_iter().map(sign).find(|side| *side != 0) != Some(turn)
    };
    if turn == 0 || is_beside(a, b) || is_beside(b, c) || is_beside(c, a) {
        return 0;
    }
    let [a, b, c, p] = [corners[0], corners[1], corners[2], point].map(|[x, y, z]| Coord3D { x, y, z });
    if sign(orient3d(a, b, c, p)) == turn { turn } else { 0 }
}

fn sign(value: f64) -> i32 {
    i32::from(value > 0.0) - i32::from(value < 0.0)
}

fn place(v: Vec3<f64>) -> Coord3D<f64> {
    Coord3D { x: v.x, y: v.y, z: v.z }
}

/// On which sides of the plane of a triangle the ends of an edge lie: of one sign on one side, 0 upon it.
fn sides(edge: [Vec3<f64>; 2], triangle: [Vec3<f64>; 3]) -> [f64; 2] {
    let [a, b, c] = triangle.map(place);
    edge.map(|end| orient3d(a, b, c, place(end)))
}

/// Whether the line through an edge that does not lie in the plane of a triangle meets the triangle, its border included.
fn meets(edge: [Vec3<f64>; 2], triangle: [Vec3<f64>; 3]) -> bool {
    let ([p, q], [a, b, c]) = (edge.map(place), triangle.map(place));
    let turns = [[a, b], [b, c], [c, a]].map(|[from, to]| orient3d(p, q, from, to));
    turns.iter().all(|turn| *turn >= 0.0) || turns.iter().all(|turn| *turn <= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64, z: f64) -> Vec3<f64> {
        Vec3::new(x, y, z)
    }

    fn triangle() -> [Vec3<f64>; 3] {
        [at(0.0, 0.0, 0.0), at(4.0, 0.0, 0.0), at(0.0, 4.0, 0.0)]
    }

    /// Whether an edge crosses a triangle, whatever stands first, of the edge and of the triangle.
    #[track_caller]
    fn cross(edge: [Vec3<f64>; 2], triangle: [Vec3<f64>; 3]) -> bool {
        let ([p, q], [a, b, c]) = (edge, triangle);
        let found = crosses(edge, triangle);
        for edge in [[p, q], [q, p]] {
            for triangle in [[a, b, c], [b, c, a], [c, a, b], [c, b, a], [b, a, c], [a, c, b]] {
                assert_eq!(crosses(edge, triangle), found, "{edge:?} {triangle:?}");
            }
        }
        found
    }

    #[test]
    fn an_edge_crosses_what_it_goes_through() {
        assert!(cross([at(1.0, 1.0, -1.0), at(1.0, 1.0, 2.0)], triangle()));
        assert!(!cross([at(3.0, 3.0, -1.0), at(3.0, 3.0, 2.0)], triangle()));
        assert!(!cross([at(1.0, 1.0, 1.0), at(1.0, 1.0, 2.0)], triangle()));
        assert!(cross([at(-1.0, 1.0, -1.0), at(9.0, 1.0, 4.0)], triangle()));
    }

    #[test]
    fn a_nanometre_is_seen_far_away_as_well() {
        let depth = 1e-9;
        for far in [0.0, 1e6] {
            let moved = triangle().map(|place| place + at(far, far, 0.0));
            for (z, expected) in [(depth, true), (0.0, false), (-depth, false), (1e-300, true)] {
                assert_eq!(
                    cross([at(far + 1.0, far + 1.0, -1.0), at(far + 1.0, far + 1.0, z)], moved),
                    expected
                );
            }
            // Inside of the border, and outside of it.
            for (x, expected) in [(depth, true), (-depth, false)] {
                assert_eq!(
                    cross([at(far + x, far + 1.0, -1.0), at(far + x, far + 1.0, 1.0)], moved),
                    expected
                );
            }
        }
    }

    #[test]
    fn an_edge_that_ends_on_a_triangle_or_lies_in_its_plane_touches_it() {
        for end in [at(1.0, 1.0, 0.0), at(2.0, 0.0, 0.0), at(0.0, 0.0, 0.0)] {
            assert!(!cross([end, at(1.0, 1.0, 5.0)], triangle()));
            assert!(!cross([end, at(1.0, 0.5, 0.0)], triangle()));
        }
        assert!(!cross([at(-9.0, 1.0, 0.0), at(9.0, 1.0, 0.0)], triangle()));
    }

    #[test]
    fn an_edge_through_a_seam_or_a_corner_crosses_every_triangle_there() {
        let [a, b, c] = triangle();
        for place in [at(2.0, 2.0, 0.0), at(1.0, 3.0, 0.0), b, c] {
            let edge = [place - at(0.25, 0.5, 1.0), place + at(0.25, 0.5, 1.0)];
            assert!(cross(edge, [a, b, c]));
            assert!(cross(edge, [c, b, at(4.0, 4.0, 0.0)]));
        }
    }

    #[test]
    fn nothing_crosses_a_triangle_without_area_nor_an_edge_without_length_anything() {
        let [a, b, c] = triangle();
        let edge = [at(1.0, 0.0, -1.0), at(1.0, 0.0, 1.0)];
        assert!(!cross(edge, [a, b, at(2.0, 0.0, 0.0)]));
        assert!(!cross(edge, [a, a, a]));
        assert!(!cross([at(1.0, 1.0, 0.0); 2], [a, b, c]));
    }

    #[test]
    fn an_edge_comes_to_what_it_crosses_or_ends_on() {
        for (edge, expected) in [
            ([at(1.0, 1.0, -1.0), at(1.0, 1.0, 2.0)], true),
            ([at(1.0, 1.0, 0.0), at(1.0, 1.0, 2.0)], true),
            ([at(1.0, 1.0, 1e-300), at(1.0, 1.0, 2.0)], false),
            ([at(3.0, 3.0, 0.0), at(1.0, 1.0, 5.0)], false),
            ([at(-9.0, 1.0, 0.0), at(9.0, 1.0, 0.0)], false),
        ] {
            let [p, q] = edge;
            let found = [[p, q], [q, p]].map(|edge| comes_to(edge, triangle()));
            assert_eq!(found, [expected; 2], "{edge:?}");
        }
    }

    #[test]
    fn a_ray_through_a_seam_or_a_corner_meets_one_of_the_triangles_there() {
        let [o, x, y, far] = [[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [0.0, 4.0, 1.0], [4.0, 4.0, 1.0]];
        for point in [[1.0, 3.0, 0.0], [2.0, 2.0, -1e-300], [1.0, 0.5, 0.0], [0.0, 0.0, 0.0], [0.0, 2.0, 0.0]]
        {
            let turns = [[o, x, y], [far, y, x]].map(|corners| turn_above(point, corners));
            assert_eq!(turns[0] + turns[1], 1, "{point:?}: {turns:?}");
            let turns = [[o, y, x], [far, x, y]].map(|corners| turn_above(point, corners));
            assert_eq!(turns[0] + turns[1], -1, "{point:?}: {turns:?}");
        }
        // Above it, and beside it: the ray is moved along x.
        for point in [[1.0, 3.0, 1.0], [1.0, 1.0, 2.0], [4.0, 1.0, 0.0], [-1e-300, 1.0, 0.0]] {
            assert_eq!(
                [[o, x, y], [far, y, x]].map(|corners| turn_above(point, corners)),
                [0, 0],
                "{point:?}"
            );
        }
        // Upright triangles are met by none.
        assert_eq!(turn_above([1.0, 0.0, 0.0], [o, x, [2.0, 0.0, 5.0]]), 0);
    }
}
