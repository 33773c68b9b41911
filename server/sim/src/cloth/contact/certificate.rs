//! Whether a pair stays apart while its corners go straight from one place to another, without a doubt.

use super::{
    pair::Pair,
    rules::{KEPT, THIN},
};
use crate::{
    math::Vec3,
    surface::{PairKind, closest},
};

/// Share of what is certainly free that an advance goes, and the most advances.
const ADVANCE: f64 = 0.9;
const MOST_ADVANCES: u32 = 200;
/// Times what must be kept, below which an advance gives up.
const NEAR: f64 = 1.2;

/// Whether a pair whose corners go straight from `start` to `end` (m) keeps a tenth of its gap or half of its thickness, whichever is less, and more than
/// `floor` (m): one that comes from afar may end where it is held.
///
/// A plane that keeps both parts apart at the end as that across its direction does at the start keeps them apart in between: the lesser of one side less the
/// greater of the other is concave in time. Otherwise it advances by what no corner can use up (Li et al. 2021, additive continuous collision detection).
pub(crate) fn is_safe(pair: &Pair, start: [Vec3<f64>; 4], end: [Vec3<f64>; 4], floor: f64) -> bool {
    let least = (KEPT * pair.hold.began).min(THIN * pair.thickness).max(floor);
    // What is not a number is not safe.
    separation(pair, end) > least || advances(pair, start, end, least)
}

/// By how much (m) the first part lies above the second along the direction that the pair had at the start.
pub(crate) fn separation(pair: &Pair, x: [Vec3<f64>; 4]) -> f64 {
    let origin = x[3];
    let [a, b, c, d] = x.map(|x| (x - origin).dot(&pair.direction));
    match pair.candidate().kind() {
        PairKind::VertexTriangle => a - b.max(c).max(d),
        PairKind::Edges => a.min(b) - c.max(d),
    }
}

fn advances(pair: &Pair, start: [Vec3<f64>; 4], end: [Vec3<f64>; 4], least: f64) -> bool {
    let mut ways: [Vec3<f64>; 4] = std::array::from_fn(|k| end[k] - start[k]);
    let mean = (ways[0] + ways[1] + ways[2] + ways[3]) * 0.25;
    for way in &mut ways {
        *way -= mean;
    }
    let [a, b, c, d] = ways.map(|way| way.norm());
    let most = match pair.candidate().kind() {
        PairKind::VertexTriangle => a + b.max(c).max(d),
        PairKind::Edges => a.max(b) + c.max(d),
    };
    let (mut gap, mut gone) = (pair.hold.began, 0.0);
    for _ in 0..MOST_ADVANCES {
        if gap <= NEAR * least {
            return false;
        }
        // What is not a number does not arrive.
        gone += ADVANCE * (gap - least) / most;
        if gone >= 1.0 {
            return true;
        }
        let there = std::array::from_fn(|k| start[k] + ways[k] * gone);
        gap = closest(pair.candidate().kind(), there).difference.norm();
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        cloth::contact::pair::Pair,
        cloth::layout::Surface,
        surface::{Candidate, Faces},
    };

    const TRIANGLE: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    /// A vertex 1 cm above a triangle that lies level; the way (m) of the vertex, and how far the triangle turns about its edge along x at the same time.
    fn judged(way: [f64; 3], lift: f64, floor: f64) -> bool {
        let surface = Surface::of_sheets(Faces::new(&[[1, 2, 3]], 4), 2e-3, 4);
        let candidate = Candidate { corners: [0, 1, 2, 3], triangle: 0 };
        let [a, b, c] = TRIANGLE.map(Vec3::from);
        let start = [Vec3::new(0.2, 0.2, 0.01), a, b, c];
        let pair = Pair::near(&surface, candidate, start, (1.0, [0.0, 1.0])).expect("it is near");
        let mut end = start;
        end[0] += Vec3::from(way);
        end[3] += Vec3::new(0.0, 0.0, lift);
        is_safe(&pair, start, end, floor)
    }

    #[test]
    fn what_goes_through_is_refused_and_what_passes_beside_is_not() {
        // Down to a tenth of the gap, and beyond it.
        assert!(judged([0.0, 0.0, -0.0085], 0.0, 0.0));
        assert!(!judged([0.0, 0.0, -0.0095], 0.0, 0.0) && !judged([0.0, 0.0, -0.02], 0.0, 0.0));
        // Through the plane, beside the triangle: no plane keeps them apart, and they do not meet.
        assert!(judged([2.0, 2.0, -0.02], 0.0, 0.0));
        // The triangle comes up, and both go up together.
        assert!(!judged([0.0; 3], 0.1, 0.0) && judged([0.0, 0.0, 0.1], 0.1, 0.0));
        // Rounding does not tell apart what is so near.
        assert!(!judged([0.0, 0.0, -0.005], 0.0, 6e-3));
        assert!(!judged([f64::NAN, 0.0, 0.0], 0.0, 0.0));
    }
}
