//! Whether an edge crosses a triangle, without an error of rounding.
//!
//! Reads places (m); signs of determinants are those of exact arithmetic (J. R. Shewchuk, "Adaptive Precision Floating-Point
//! Arithmetic and Fast Robust Geometric Predicates", 1997), unless numbers underflow: lengths of 1e-90 m are too short.

use robust::{Coord3D, orient3d};

use crate::math::Vec3;

/// Whether an edge goes through a triangle: its ends lie on the two sides of the plane, neither upon it, and the way between
/// them meets the triangle, its border included.
///
/// So an edge that goes through the seam of two triangles crosses both, and nothing passes between them. An edge that ends on
/// the triangle touches it, and so does one that lies in its plane. A triangle without area is crossed by nothing. Places are
/// finite.
pub fn crosses(edge: [Vec3<f64>; 2], triangle: [Vec3<f64>; 3]) -> bool {
    let place = |v: Vec3<f64>| Coord3D { x: v.x, y: v.y, z: v.z };
    let ([p, q], [a, b, c]) = (edge.map(place), triangle.map(place));
    let [above, below] = [p, q].map(|end| orient3d(a, b, c, end));
    let is_divided = (above > 0.0 && below < 0.0) || (above < 0.0 && below > 0.0);
    if !is_divided {
        return false;
    }
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
}
