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
