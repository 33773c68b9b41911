//! A tree of boxes around the triangles of a surface, and the triangle that is nearest to a point.
//!
//! Reads points (m) and triangles; writes the nearest triangle by (square of the distance, number). Triangles stand in the
//! order of a Hilbert curve through their centres, four to a leaf; above the leaves each box holds a half of the range
//! of the box above it. So the tree follows from the mesh alone, and the nearest one from the mesh and the point: how it
//! was found plays no part.

use super::nearest::{Triangles, WIDTH};
use crate::parallel::hilbert_order;

/// Boxes that wait to be looked at, at most: one for each level of a tree over 2^32 leaves.
const DEPTH: usize = 34;
/// Share of a distance that rounding may take of it.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// A box along the axes (m): lower and upper corner.
type Bounds = [[f64; 3]; 2];

/// Boxes over all triangles of a surface, and the triangles themselves.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    /// Triangles, four to a leaf.
    pub(super) leaves: Vec<Triangles>,
    /// Boxes, each before those of its first half, and these before those of its second.
    boxes: Vec<Bounds>,
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
        let order = hilbert_order(&centers, 0.0);
        let leaf = |numbers: &[u32]| {
            let parts: Vec<_> = numbers.iter().map(|t| (*t, corners(*t), faces[*t as usize])).collect();
            Triangles::new(&parts)
        };
        let leaves: Vec<Triangles> = order.chunks(WIDTH).map(leaf).collect();

        let around = |numbers: &[u32]| {
            let all = numbers.iter().flat_map(|t| corners(*t));
            all.fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], p| {
                [[0, 1, 2].map(|c| low[c].min(p[c])), [0, 1, 2].map(|c| high[c].max(p[c]))]
            })
        };
        let held: Vec<Bounds> = order.chunks(WIDTH).map(around).collect();
        let size = held.iter().flatten().flatten().fold(0.0, |most: f64, c| most.max(c.abs()));
        let mut boxes = Vec::with_capacity(2 * leaves.len() - 1);
        enclose(&held, ROUNDING * size, &mut boxes);
        Self { leaves, boxes }
    }

    /// The box around all of it (m), no smaller than it.
    pub(super) fn bounds(&self) -> Bounds {
        self.boxes[0]
    }

    /// The nearest triangle, and the square (m²) of its distance; none where the point (m) is not finite.
    pub(super) fn nearest(&self, p: [f64; 3]) -> Option<(f64, Leaf)> {
        let mut best = (f64::INFINITY, u32::MAX);
        let mut found = None;
        let mut waiting = [(0_usize, 0_usize, 0.0_f64); DEPTH];
        let mut count = 1;
        waiting[0] = (0, self.leaves.len(), beside(&self.boxes[0], p));
        // The range of a box begins where that of the waiting one begins.
        let mut firsts = [0_usize; DEPTH];
        while count > 0 {
            count -= 1;
            let (mut node, mut size, square) = waiting[count];
            let mut first = firsts[count];
            if !may_hold(square, best.0) {
                continue;
            }
            while size > 1 {
                let half = size / 2;
                let (left, right) = (node + 1, node + 2 * half);
                let [to_left, to_right] = [beside(&self.boxes[left], p), beside(&self.boxes[right], p)];
                let (goes_left, later) =
                    if to_left <= to_right { (true, to_right) } else { (false, to_left) };
                let other = if goes_left { (right, size - half, later) } else { (left, half, later) };
                if may_hold(later, best.0) {
                    waiting[count] = other;
                    firsts[count] = if goes_left { first + half } else { first };
                    count += 1;
                }
                if goes_left {
                    (node, size) = (left, half);
                } else {
                    (node, size, first) = (right, size - half, first + half);
                }
            }
            let triangles = &self.leaves[first];
            for (lane, square) in triangles.squares(p).into_iter().enumerate() {
                let this = (square, triangles.number[lane]);
                if this < best {
                    best = this;
                    found = Some((square, Leaf { leaf: first, lane }));
                }
            }
        }
        found
    }
}

/// Writes the box around a range of leaves, which is wider by `spare` (m), and those of its halves after it.
fn enclose(leaves: &[Bounds], spare: f64, boxes: &mut Vec<Bounds>) -> Bounds {
    let place = boxes.len();
    boxes.push([[0.0; 3]; 2]);
    boxes[place] = if let [[low, high]] = leaves {
        [low.map(|c| c - spare), high.map(|c| c + spare)]
    } else {
        let (left, right) = leaves.split_at(leaves.len() / 2);
        let [a, b] = [left, right].map(|half| enclose(half, spare, boxes));
        [[0, 1, 2].map(|c| a[0][c].min(b[0][c])), [0, 1, 2].map(|c| a[1][c].max(b[1][c]))]
    };
    boxes[place]
}

/// Square (m²) of the distance of a point from a box: 0 within it.
#[inline(always)]
fn beside([low, high]: &Bounds, p: [f64; 3]) -> f64 {
    let gap = |c: usize| (low[c] - p[c]).max(p[c] - high[c]).max(0.0);
    let [x, y, z] = [gap(0), gap(1), gap(2)];
    x * x + y * y + z * z
}

/// Whether a box so far away (m²) may hold a triangle that is as near as the best one.
#[inline(always)]
fn may_hold(square: f64, best: f64) -> bool {
    square * (1.0 - ROUNDING) <= best
}
