//! Boxes within boxes: how they are put around what is in them, and which of them may hold what is nearest to a point.
//!
//! Reads boxes (m) along the axes, or centres; writes nodes of four. Ranges are halved across their longest sides, so that nodes
//! follow from the boxes alone.

use super::four::{Four, WIDTH};

/// Nodes and leaves that wait to be looked at, at most: three for each level of a tree over 2^32 leaves.
pub(super) const DEPTH: usize = 64;
/// Share of a distance that rounding may take of it.
pub(super) const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// What tells a leaf from a node.
pub(super) const LEAF: u32 = 1 << 31;
/// Stands where a node has fewer children, and where there is no second root.
pub(super) const NONE: u32 = u32::MAX;
/// The node over everything that a tree shows.
pub(super) const ROOT: u32 = 0;

/// A box along the axes (m): lower and upper corner.
pub(super) type Bounds = [[f64; 3]; 2];

/// Four boxes and what is within them.
#[derive(Clone, Debug)]
pub(super) struct Node {
    low: [Four; 3],
    high: [Four; 3],
    /// Numbers of nodes, or of leaves.
    pub(super) children: [u32; WIDTH],
}

impl Node {
    /// Lets those children wait that may hold a triangle nearer to a point (m) than the best one (m²). The nearest of them comes
    /// last: it is looked at first.
    #[inline(always)]
    pub(super) fn children(
        &self,
        p: [f64; 3],
        best: f64,
        waiting: &mut [(f64, u32); DEPTH],
        count: &mut usize,
    ) {
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
    pub(super) fn beside(&self, p: [f64; 3]) -> Four {
        self.apart([p; 2])
    }

    /// Squares (m²) of the distances of a box (m) from the boxes: 0 where they meet.
    #[inline(always)]
    fn apart(&self, [low, high]: Bounds) -> Four {
        let gap = |c: usize| {
            let (low, high) = (Four::all(low[c]), Four::all(high[c]));
            (self.low[c] - high).max(low - self.high[c]).max(Four::all(0.0))
        };
        let [x, y, z] = [gap(0), gap(1), gap(2)];
        x * x + y * y + z * z
    }
}

/// How many nodes and leaves were looked at: what questions cost.
#[cfg(test)]
#[derive(Clone, Debug, Default)]
pub(super) struct Looks(std::sync::Arc<std::sync::atomic::AtomicU64>);

#[cfg(test)]
impl Looks {
    /// Counts one node or leaf that is looked at.
    pub(super) fn add(&self) {
        self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
    }

    /// How many there were since they were asked for.
    pub(super) fn take(&self) -> u64 {
        self.0.swap(0, std::sync::atomic::Ordering::Relaxed)
    }
}

/// Boxes, and which of them hold a point or meet a box.
#[derive(Clone, Debug)]
pub(super) struct Boxes {
    nodes: Vec<Node>,
    /// What each box is of.
    names: Vec<u32>,
    #[cfg(test)]
    pub(super) looks: Looks,
}

impl Boxes {
    /// Of boxes (m) with their names; there may be none.
    pub(super) fn new(boxes: &[(u32, Bounds)]) -> Self {
        let bounds: Vec<Bounds> = boxes.iter().map(|(_, bounds)| *bounds).collect();
        let order = sorted(&bounds);
        let bounds: Vec<Bounds> = order.iter().map(|place| bounds[*place as usize]).collect();
        let mut nodes = Vec::new();
        enclose(&bounds, 0, &mut nodes);
        let names = order.into_iter().map(|place| boxes[place as usize].0).collect();
        Self {
            nodes,
            names,
            #[cfg(test)]
            looks: Looks::default(),
        }
    }

    /// Calls `note` with the name of each box that holds a point (m).
    pub(super) fn around(&self, p: [f64; 3], note: impl FnMut(u32)) {
        self.meeting([p; 2], note);
    }

    /// Calls `note` with the name of each box that meets one (m), which may have no end.
    pub(super) fn meeting(&self, bounds: Bounds, mut note: impl FnMut(u32)) {
        let mut waiting = [ROOT; DEPTH];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            #[cfg(test)]
            self.looks.add();
            let node = &self.nodes[waiting[count] as usize];
            let Four(squares) = node.apart(bounds);
            for (square, child) in squares.into_iter().zip(node.children) {
                if child == NONE || square > 0.0 {
                    continue;
                }
                if child & LEAF == 0 {
                    waiting[count] = child;
                    count += 1;
                } else {
                    note(self.names[(child & !LEAF) as usize]);
                }
            }
        }
    }
}

/// Sorts triangles so that leaves, and halves of ranges of them, are apart: each range is divided across its longest side,
/// between leaves.
pub(super) fn sort(order: &mut [u32], centers: &[[f64; 3]]) {
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
pub(super) fn around(boxes: impl Iterator<Item = Bounds>) -> Bounds {
    boxes.fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], [from, to]| {
        [[0, 1, 2].map(|c| low[c].min(from[c])), [0, 1, 2].map(|c| high[c].max(to[c]))]
    })
}

/// Writes the node over some leaves, of which the first has this number, and those below it; gives the box around it.
pub(super) fn enclose(leaves: &[Bounds], first: usize, nodes: &mut Vec<Node>) -> Bounds {
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

/// Numbers of boxes, so that those near each other in space are near each other in the list.
pub(super) fn sorted(boxes: &[Bounds]) -> Vec<u32> {
    let middles: Vec<[f64; 3]> =
        boxes.iter().map(|[low, high]| [0, 1, 2].map(|c| low[c].midpoint(high[c]))).collect();
    let mut order: Vec<u32> = (0_u32..).take(boxes.len()).collect();
    sort(&mut order, &middles);
    order
}

/// The two halves of a range.
fn halves(range: std::ops::Range<usize>) -> [std::ops::Range<usize>; 2] {
    let middle = range.start.midpoint(range.end);
    [range.start..middle, middle..range.end]
}

/// Whether a box so far away (m²) may hold a triangle that is as near as the best one.
#[inline(always)]
pub(super) fn may_hold(square: f64, best: f64) -> bool {
    square * (1.0 - ROUNDING) <= best
}
