//! A tree of boxes around the triangles of a surface, and the triangle that is nearest to a point.
//!
//! Reads points (m) and triangles; writes the nearest triangle by (square of the distance, number). Ranges of
//! triangles are halved across their longest sides, down to four in a leaf; a node has boxes around quarters of a range. So
//! the tree follows from the mesh alone, and the nearest one from the mesh and the point: how it was found plays no part.

use super::{
    four::{Four, WIDTH},
    nearest::{Part, Triangles},
};
use crate::math::{Pack, WithSimd, dispatch};

/// Nodes and leaves that wait to be looked at, at most: three for each level of a tree over 2^32 leaves.
const DEPTH: usize = 64;
/// Triangles that are kept around a place.
pub(super) const KEPT: usize = 4;
/// Share of a distance that rounding may take of it.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// What tells a leaf from a node.
const LEAF: u32 = 1 << 31;
/// Stands where a node has fewer children.
const NONE: u32 = u32::MAX;

/// A box along the axes (m): lower and upper corner.
type Bounds = [[f64; 3]; 2];

/// Boxes over all triangles of a surface, and the triangles themselves.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    /// Triangles, four to a leaf.
    pub(super) leaves: Vec<Triangles>,
    /// The first one is over all leaves.
    nodes: Vec<Node>,
    bounds: Bounds,
}

/// Four boxes and what is within them.
#[derive(Clone, Debug)]
pub(super) struct Node {
    low: [Four; 3],
    high: [Four; 3],
    /// Numbers of nodes, or of leaves.
    children: [u32; WIDTH],
}

impl Node {
    /// Lets those children wait that may hold a triangle nearer to a point (m) than the best one (m²). The nearest of them comes
    /// last: it is looked at first.
    #[inline(always)]
    fn children(&self, p: [f64; 3], best: f64, waiting: &mut [(f64, u32); DEPTH], count: &mut usize) {
        let Four(squares) = self.beside(p);
        let first = *count;
        for (square, child) in squares.into_iter().zip(self.children) {
            if child == NONE || !may_hold(square, best) {
                continue;
            }
            let mut place = *count;
            while place > first && waiting[place - 1].0 < square {
                waiting[place] = waiting[place - 1];
                place -= 1;
            }
            waiting[place] = (square, child);
            *count += 1;
        }
    }

    /// Squares (m²) of the distances of a point (m) from the boxes: 0 within one.
    #[inline(always)]
    fn beside(&self, p: [f64; 3]) -> Four {
        let gap = |c: usize| {
            let p = Four::all(p[c]);
            (self.low[c] - p).max(p - self.high[c]).max(Four::all(0.0))
        };
        let [x, y, z] = [gap(0), gap(1), gap(2)];
        x * x + y * y + z * z
    }
}

/// A triangle: its leaf, and its place there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Leaf {
    pub(super) leaf: usize,
    pub(super) lane: usize,
}

impl Tree {
    /// Over at least one triangle; `faces` are their unit normals.
    pub(super) fn new(points: &[[f64; 3]], triangles: &[[u32; 3]], faces: &[[f64; 3]]) -> Self {
        let corners = |t: u32| triangles[t as usize].map(|i| points[i as usize]);
        let center = |t: u32| {
            let [a, b, c] = corners(t);
            [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0)
        };
        let centers: Vec<[f64; 3]> = (0_u32..).take(triangles.len()).map(center).collect();
        let mut order: Vec<u32> = (0_u32..).take(triangles.len()).collect();
        sort(&mut order, &centers);
        let leaf = |numbers: &[u32]| {
            let part = |t: &u32| Part { number: *t, corners: corners(*t), normal: faces[*t as usize] };
            let parts: Vec<Part> = numbers.iter().map(part).collect();
            Triangles::new(&parts)
        };
        let leaves = order.chunks(WIDTH).map(leaf).collect();

        let around = |numbers: &[u32]| around(numbers.iter().flat_map(|t| corners(*t)).map(|p| [p, p]));
        let held: Vec<Bounds> = order.chunks(WIDTH).map(around).collect();
        let size = held.as_flattened().as_flattened().iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        let wider =
            |[low, high]: Bounds| [low.map(|c| c - ROUNDING * size), high.map(|c| c + ROUNDING * size)];
        let held: Vec<Bounds> = held.into_iter().map(wider).collect();
        let mut nodes = Vec::new();
        let bounds = enclose(&held, 0, &mut nodes);
        Self { leaves, nodes, bounds }
    }

    /// The box around all of it (m), no smaller than it.
    pub(super) fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Bytes for each leaf, nearly.
    pub(super) const fn bytes_per_leaf() -> u64 {
        // A node has two children at least, and nearly always four.
        (size_of::<Triangles>() + size_of::<Node>() / 2) as u64
    }

    /// The nearest triangle, and the square (m²) of its distance; none where the point (m) is not finite.
    pub(super) fn nearest(&self, p: [f64; 3]) -> Option<(f64, Leaf)> {
        dispatch(Nearest { tree: self, p })
    }

    /// The triangles that are nearest to a point (m), the nearest first, with their distances (m), and a distance that no other
    /// one comes nearer than.
    pub(super) fn around(&self, p: [f64; 3]) -> ([Option<(Leaf, f64)>; KEPT], f64) {
        let mut nearest = [(f64::INFINITY, None); KEPT + 1];
        let mut waiting = [(0.0_f64, 0_u32); DEPTH];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (square, child) = waiting[count];
            if !may_hold(square, nearest[KEPT].0) {
                continue;
            }
            if child & LEAF == 0 {
                self.nodes[child as usize].children(p, nearest[KEPT].0, &mut waiting, &mut count);
                continue;
            }
            let leaf = (child & !LEAF) as usize;
            let triangles = &self.leaves[leaf];
            for (lane, square) in triangles.squares(p).into_iter().enumerate() {
                // A leaf that is not full has its last triangle several times.
                let is_repeated = triangles.number[..lane].contains(&triangles.number[lane]);
                if square < nearest[KEPT].0 && !is_repeated {
                    let place = nearest.iter().filter(|(other, _)| *other <= square).count();
                    nearest[place..].rotate_right(1);
                    nearest[place] = (square, Some(Leaf { leaf, lane }));
                }
            }
        }
        let shorter = |square: f64| square.sqrt() * (1.0 - ROUNDING);
        let kept = std::array::from_fn(|k| nearest[k].1.map(|leaf| (leaf, shorter(nearest[k].0))));
        (kept, shorter(nearest[KEPT].0))
    }
}

/// The nearest triangle so far.
struct Best {
    square: f64,
    number: u32,
    leaf: Option<Leaf>,
}

impl Best {
    #[inline(always)]
    fn none() -> Self {
        Self { square: f64::INFINITY, number: u32::MAX, leaf: None }
    }

    /// Looks at the triangles of a leaf.
    #[inline(always)]
    fn look(&mut self, tree: &Tree, leaf: usize, p: [f64; 3]) {
        let triangles = &tree.leaves[leaf];
        for (lane, square) in triangles.squares(p).into_iter().enumerate() {
            let number = triangles.number[lane];
            if square < self.square || (square == self.square && number < self.number) {
                *self = Self { square, number, leaf: Some(Leaf { leaf, lane }) };
            }
        }
    }

    fn found(&self) -> Option<(f64, Leaf)> {
        self.leaf.map(|leaf| (self.square, leaf))
    }
}

/// The search for the nearest triangle.
struct Nearest<'a> {
    tree: &'a Tree,
    p: [f64; 3],
}

impl WithSimd<f64> for Nearest<'_> {
    const WIDE_BINARY64: bool = false;
    type Output = Option<(f64, Leaf)>;

    #[inline(always)]
    fn run<P: Pack<Number = f64>>(self) -> Self::Output {
        let Self { tree, p } = self;
        let mut best = Best::none();
        let mut waiting = [(0.0_f64, 0_u32); DEPTH];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (square, child) = waiting[count];
            if !may_hold(square, best.square) {
                continue;
            }
            if child & LEAF != 0 {
                best.look(tree, (child & !LEAF) as usize, p);
                continue;
            }
            tree.nodes[child as usize].children(p, best.square, &mut waiting, &mut count);
        }
        best.found()
    }
}

/// Sorts triangles so that leaves, and halves of ranges of them, are apart: each range is divided across its longest side,
/// between leaves.
fn sort(order: &mut [u32], centers: &[[f64; 3]]) {
    let leaves = order.len().div_ceil(WIDTH);
    if leaves <= 1 {
        return;
    }
    let [low, high] = around(order.iter().map(|t| [centers[*t as usize]; 2]));
    let side = |c: usize| high[c] - low[c];
    let axis = (1..3).fold(0, |axis, c| if side(c) > side(axis) { c } else { axis });
    let middle = halves(0..leaves)[0].end * WIDTH;
    let by = |t: &u32| centers[*t as usize][axis];
    order.select_nth_unstable_by(middle, |a, b| by(a).total_cmp(&by(b)).then(a.cmp(b)));
    let (left, right) = order.split_at_mut(middle);
    sort(left, centers);
    sort(right, centers);
}

/// The box around boxes.
fn around(boxes: impl Iterator<Item = Bounds>) -> Bounds {
    boxes.fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], [from, to]| {
        [[0, 1, 2].map(|c| low[c].min(from[c])), [0, 1, 2].map(|c| high[c].max(to[c]))]
    })
}

/// Writes the node over some leaves, of which the first has this number, and those below it; gives the box around it.
fn enclose(leaves: &[Bounds], first: usize, nodes: &mut Vec<Node>) -> Bounds {
    let place = nodes.len();
    let nowhere = Four::all(f64::NAN);
    nodes.push(Node { low: [nowhere; 3], high: [nowhere; 3], children: [NONE; WIDTH] });
    let [left, right] = halves(0..leaves.len());
    let quarters = [left, right].map(halves).into_iter().flatten();
    for (lane, range) in quarters.filter(|range| !range.is_empty()).enumerate() {
        let start = first + range.start;
        let (child, bounds) = if let [bounds] = &leaves[range.clone()] {
            (start as u32 | LEAF, *bounds)
        } else {
            (nodes.len() as u32, enclose(&leaves[range], start, nodes))
        };
        let node = &mut nodes[place];
        node.children[lane] = child;
        for c in 0..3 {
            (node.low[c].0[lane], node.high[c].0[lane]) = (bounds[0][c], bounds[1][c]);
        }
    }
    around(leaves.iter().copied())
}

/// The two halves of a range.
fn halves(range: std::ops::Range<usize>) -> [std::ops::Range<usize>; 2] {
    let middle = range.start.midpoint(range.end);
    [range.start..middle, middle..range.end]
}

/// Whether a box so far away (m²) may hold a triangle that is as near as the best one.
#[inline(always)]
fn may_hold(square: f64, best: f64) -> bool {
    square * (1.0 - ROUNDING) <= best
}
