//! The neighbour that continues an edge most nearly straight: what a bending spring joins on a mesh.
//!
//! Enters: a mesh. Leaves: pairs of points. Work grows as n log n with the edges, at a point of many edges too:
//! their directions are in a tree of boxes.

use crate::{
    interrupt,
    math::array::{dot, length, minus},
    mesh::{TriangleMesh, sorted},
};

/// Least cosine of the angle by which a continuation turns: 45 degrees.
const LEAST_COSINE: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Directions that are looked at one by one.
const LEAF: usize = 16;

/// For each edge a -> b, the neighbour c of b that continues it most nearly straight, if it turns
/// by less than 45 degrees: the pair (a, c), sorted. The first neighbour in the order of edges wins a tie.
pub(crate) fn straight_continuations(mesh: &TriangleMesh) -> Vec<[u32; 2]> {
    let mut neighbours = vec![Vec::new(); mesh.points.len()];
    for [a, b] in mesh.edges() {
        neighbours[a as usize].push(b);
        neighbours[b as usize].push(a);
    }

    let direction = |a: u32, b: u32| {
        let (p, q) = (mesh.points[a as usize], mesh.points[b as usize]);
        let length = length(minus(q, p)).max(f64::MIN_POSITIVE);
        minus(q, p).map(|c| c / length)
    };

    let mut pairs = Vec::new();
    for (b, around) in (0u32..).zip(&neighbours) {
        interrupt::point();
        let tree = Directions::new(around.iter().map(|c| direction(b, *c)).collect());
        for (own, &a) in (0u32..).zip(around) {
            let best = tree.nearest(direction(a, b), own);
            pairs.extend(best.map(|c| around[c as usize]).map(|c| (a.min(c), a.max(c))));
        }
    }

    let mut pairs = sorted(pairs.iter().copied(), mesh.points.len());
    pairs.dedup();
    pairs.into_iter().map(|(a, c)| [a, c]).collect()
}

/// Directions in a tree of boxes.
struct Directions {
    /// Each with its place in the order that was given, leaf after leaf.
    directions: Vec<([f64; 3], u32)>,
    root: Node,
}

/// Directions `from..to`, the box around them, and the first of them in the order that was given.
struct Node {
    range: [usize; 2],
    low: [f64; 3],
    high: [f64; 3],
    first: u32,
    halves: Option<Box<[Node; 2]>>,
}

/// The best so far: cosine and place.
type Best = (f64, Option<u32>);

impl Directions {
    fn new(directions: Vec<[f64; 3]>) -> Self {
        let mut directions: Vec<_> = directions.into_iter().zip(0u32..).collect();
        let count = directions.len();
        let root = Node::new(&mut directions, [0, count]);
        Self { directions, root }
    }

    /// The direction nearest to `along`, besides that of place `own`.
    fn nearest(&self, along: [f64; 3], own: u32) -> Option<u32> {
        let mut best = (LEAST_COSINE, None);
        self.search(&self.root, along, own, &mut best);
        best.1
    }

    fn search(&self, node: &Node, along: [f64; 3], own: u32, best: &mut Best) {
        if !is_better(node.bound(along), node.first, *best) {
            return;
        }
        if let Some(halves) = &node.halves {
            let [left, right] = &**halves;
            let rank = |node: &Node| (node.bound(along), u32::MAX - node.first);
            let order = if rank(left) >= rank(right) { [left, right] } else { [right, left] };
            for half in order {
                self.search(half, along, own, best);
            }
            return;
        }
        let [from, to] = node.range;
        for &(direction, place) in self.directions[from..to].iter().filter(|(_, place)| *place != own) {
            let cosine = dot(along, direction);
            if is_better(cosine, place, *best) {
                *best = (cosine, Some(place));
            }
        }
    }
}

/// Whether a cosine is larger than the best, or as large and of an earlier place.
fn is_better(cosine: f64, place: u32, best: Best) -> bool {
    cosine > best.0 || (cosine == best.0 && best.1.is_some_and(|there| place < there))
}

impl Node {
    fn new(all: &mut [([f64; 3], u32)], range: [usize; 2]) -> Self {
        let own = &mut all[range[0]..range[1]];
        let (mut low, mut high, mut first) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3], u32::MAX);
        for (direction, place) in own.iter() {
            low = [0, 1, 2].map(|c| low[c].min(direction[c]));
            high = [0, 1, 2].map(|c| high[c].max(direction[c]));
            first = first.min(*place);
        }

        let count = own.len();
        if count <= LEAF {
            return Self { range, low, high, first, halves: None };
        }

        let extent = [0, 1, 2].map(|c| high[c] - low[c]);
        let axis = (0..3).fold(0, |best, c| if extent[c] > extent[best] { c } else { best });
        own.select_nth_unstable_by(count / 2, |(a, i), (b, j)| a[axis].total_cmp(&b[axis]).then(i.cmp(j)));
        let middle = range[0] + count / 2;
        let halves = [[range[0], middle], [middle, range[1]]].map(|range| Self::new(all, range));
        Self { range, low, high, first, halves: Some(Box::new(halves)) }
    }

    /// No cosine within the box is larger: rounding is monotonic, and the terms are added as in `dot`.
    fn bound(&self, along: [f64; 3]) -> f64 {
        let most = [0, 1, 2].map(|c| (along[c] * self.low[c]).max(along[c] * self.high[c]));
        most[0] + most[1] + most[2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn by_brute_force(directions: &[[f64; 3]], along: [f64; 3], own: u32) -> Option<u32> {
        let mut best = (LEAST_COSINE, None);
        for (place, direction) in (0u32..).zip(directions).filter(|(place, _)| *place != own) {
            let cosine = dot(along, *direction);
            if cosine > best.0 {
                best = (cosine, Some(place));
            }
        }
        best.1
    }

    /// A number of [-1, 1] with few digits, so that directions are repeated.
    fn coarse(i: u32) -> f64 {
        f64::from(i.wrapping_mul(2_654_435_761) >> 29) / 4.0 - 1.0
    }

    #[test]
    fn the_tree_finds_what_a_look_at_every_direction_finds() {
        for count in [0, 1, 5, 17, 300] {
            let unit = |v: [f64; 3]| v.map(|c| c / length(v).max(f64::MIN_POSITIVE));
            let all: Vec<[f64; 3]> =
                (0..count).map(|i| unit([coarse(3 * i), coarse(3 * i + 1), coarse(3 * i + 2)])).collect();
            let tree = Directions::new(all.clone());
            for (own, direction) in (0u32..).zip(&all) {
                let along = direction.map(|c| -c);
                assert_eq!(tree.nearest(along, own), by_brute_force(&all, along, own), "{own} of {count}");
            }
        }
    }

    /// A fan of 200 000 edges, whose directions are all alike in one of two cases: minutes by brute force.
    #[test]
    fn a_point_of_many_edges_costs_no_more_for_each_of_them() {
        let count = 200_000_u32;
        for flat in [false, true] {
            let rim = |i: u32| {
                let angle = if flat { 0.0 } else { f64::from(i) / f64::from(count) * std::f64::consts::TAU };
                let radius = 1.0 + f64::from(i);
                [radius * libm::cos(angle), radius * libm::sin(angle), 0.0]
            };
            let points = std::iter::once([0.0; 3]).chain((0..count).map(rim)).collect();
            let triangles = (1..count).map(|i| [0, i, i + 1]).collect();
            let mesh = TriangleMesh { points, triangles, ..TriangleMesh::default() };
            let pairs = straight_continuations(&mesh);
            assert!(pairs.len() > 100_000, "{} pairs", pairs.len());
        }
    }
}
