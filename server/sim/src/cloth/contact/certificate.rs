//! Whether a pair stays apart while its corners go straight from one place to another, without a doubt.

use super::pair::{KEPT, Pair};
use crate::{
    math::Vec3,
    surface::{PairKind, closest},
};

/// Share of what is certainly free that an advance goes, and the most advances.
const ADVANCE: f64 = 0.9;
const MOST_ADVANCES: u32 = 200;
/// Times what must be kept, below which an advance gives up.
const NEAR: f64 = 1.2;

/// Whether a pair whose corners go straight from `start` to `end` (m) keeps a tenth of its gap, and more than `floor` (m).
///
/// A plane that keeps both parts apart at the end as that across its direction does at the start keeps them apart in between: the lesser of one side less the
/// greater of the other is concave in time. Otherwise it advances by what no corner can use up (Li et al. 2021, additive continuous collision detection).
pub(crate) fn is_safe(pair: &Pair, start: [Vec3<f64>; 4], end: [Vec3<f64>; 4], floor: f64) -> bool {
    let least = (KEPT * pair.gap).max(floor);
    // What is not a number is not safe.
    separation(pair, end) > least || advances(pair, start, end, least)
}

/// By how much (m) the first part lies above the second along the direction of the pair.
pub(crate) fn separation(pair: &Pair, x: [Vec3<f64>; 4]) -> f64 {
    let origin = x[3];
    let [a, b, c, d] = x.map(|x| (x - origin).dot(&pair.normal));
    match pair.candidate.kind {
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
    let most = match pair.candidate.kind {
        PairKind::VertexTriangle => a + b.max(c).max(d),
        PairKind::Edges => a.max(b) + c.max(d),
    };
    let (mut gap, mut gone) = (pair.gap, 0.0);
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
        gap = closest(pair.candidate.kind, there).difference.norm();
    }
    false
}
