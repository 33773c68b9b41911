//! How far apart two parts are along a direction, which costs less than their closest points.
//!
//! Reads four places (m) and a direction; writes a gap, in m for a direction of length 1. The gap at a time between two states
//! is no smaller than the lesser of theirs where particles go straight: along a direction the least height of one part is
//! concave in time, the greatest of the other convex.

use super::distance::PairKind;
use crate::math::Vec3;

/// The way (m) from the middle of the second part to that of the first: a direction that tells most pairs apart.
#[inline(always)]
pub fn between_middles(kind: PairKind, [x, a, b, c]: [Vec3<f64>; 4]) -> Vec3<f64> {
    match kind {
        PairKind::VertexTriangle => ((x - a) + (x - b) + (x - c)) * (1.0 / 3.0),
        PairKind::Edges => ((x - b) + (a - c)) * 0.5,
    }
}

/// How far the first part lies beyond the second along a direction: the least of one less the greatest of the other, below 0
/// where they overlap. No points of the two are nearer to each other than this over the length of the direction.
#[inline(always)]
pub fn gap_along(kind: PairKind, [x, a, b, c]: [Vec3<f64>; 4], direction: &Vec3<f64>) -> f64 {
    let [a, b, c] = [direction.dot(&(a - x)), direction.dot(&(b - x)), direction.dot(&(c - x))];
    match kind {
        PairKind::VertexTriangle => -(a.max(b).max(c)),
        PairKind::Edges => a.min(0.0) - b.max(c),
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::{distance::closest, numbers::Numbers},
        *,
    };

    #[test]
    fn along_the_closest_points_the_gap_is_the_distance_and_along_no_direction_more() {
        let mut numbers = Numbers(9);
        for _ in 0..500 {
            for kind in [PairKind::VertexTriangle, PairKind::Edges] {
                let x = numbers.places();
                let way = closest(kind, x).difference;
                let distance = way.norm();
                assert!((gap_along(kind, x, &way) - distance * distance).abs() < 1e-12 * distance);
                for direction in [between_middles(kind, x), numbers.place(), -way] {
                    let least = gap_along(kind, x, &direction) / direction.norm();
                    assert!(least <= distance * (1.0 + 1.0 / 256.0) + 1e-14, "{kind:?} {x:?}");
                }
            }
        }
    }

    #[test]
    fn middles_tell_apart_what_boxes_do_not() {
        let at = |x: f64, y: f64| Vec3::new(x, y, 0.0);
        // Of a quad's triangle the corner that is not its own; of its diagonal an edge that goes on from there.
        let corner = [at(1.0, 1.0), at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)];
        let edge = [at(1.0, 1.0), at(2.0, 1.0), at(1.0, 0.0), at(0.0, 1.0)];
        for (kind, x, least) in [(PairKind::VertexTriangle, corner, 0.7), (PairKind::Edges, edge, 0.4)] {
            let way = between_middles(kind, x);
            assert!(gap_along(kind, x, &way) > least * way.norm(), "{kind:?}");
        }
    }

    #[test]
    fn between_two_states_the_gap_is_no_smaller_than_in_both() {
        let mut numbers = Numbers(4);
        for _ in 0..200 {
            for kind in [PairKind::VertexTriangle, PairKind::Edges] {
                let (start, end): ([Vec3<f64>; 4], [Vec3<f64>; 4]) = (numbers.places(), numbers.places());
                let direction = numbers.place();
                let gap = |x| gap_along(kind, x, &direction);
                for i in 1..8 {
                    let t = f64::from(i) / 8.0;
                    let now = std::array::from_fn(|k| start[k] * (1.0 - t) + end[k] * t);
                    assert!(gap(now) >= gap(start).min(gap(end)) - 1e-14);
                }
            }
        }
    }
}
