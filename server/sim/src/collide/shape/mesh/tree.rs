//! A tree of boxes around the triangles of a surface, and the triangle that is nearest to a point.
//!
//! Reads points (m) and triangles; writes the nearest triangle by (square of the distance, number). Ranges of
//! triangles are halved across their longest sides, down to four in a leaf; a node has boxes around quarters of a range. So
//! the tree follows from the mesh alone, and the nearest one from the mesh and the point: how it was found plays no part.

#[cfg(test)]
use super::boxes::Looks;
use super::{
    boxes::{Bounds, DEPTH, LEAF, NONE, Node, ROOT, ROUNDING, around, enclose, may_hold, sort, sorted},
    four::{Four, WIDTH},
    nearest::{Part, Triangles},
};
use crate::math::{Pack, WithSimd, dispatch};

/// Triangles that are kept around a place.
pub(super) const KEPT: usize = 4;

/// Boxes over all triangles of a surface, and the triangles themselves.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    /// Triangles, four to a leaf.
    pub(super) leaves: Vec<Triangles>,
    /// The first one is over all leaves.
    nodes: Vec<Node>,
    bounds: Bounds,
    #[cfg(test)]
    pub(super) looks: Looks,
}

/// A triangle: its leaf, and its place there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Leaf {
    pub(super) leaf: usize,
    pub(super) lane: usize,
}

/// A surface as trees are made over it: points (m), triangles, and unit normals of these.
#[derive(Clone, Copy)]
pub(super) struct Mesh<'a> {
    pub(super) points: &'a [[f64; 3]],
    pub(super) triangles: &'a [[u32; 3]],
    pub(super) faces: &'a [[f64; 3]],
}

impl Mesh<'_> {
    /// The corners (m) of a triangle.
    pub(super) fn corners(&self, t: u32) -> [[f64; 3]; 3] {
        self.triangles[t as usize].map(|i| self.points[i as usize])
    }

    /// The box around triangles (m).
    pub(super) fn around(&self, numbers: &[u32]) -> Bounds {
        around(numbers.iter().flat_map(|t| self.corners(*t)).map(|p| [p, p]))
    }

    fn leaf(&self, numbers: &[u32]) -> Triangles {
        let part = |t: &u32| Part { number: *t, corners: self.corners(*t), normal: self.faces[*t as usize] };
        let parts: Vec<Part> = numbers.iter().map(part).collect();
        Triangles::new(&parts)
    }
}

impl Tree {
    /// Over groups of triangles, none of them empty: gives the root of each group too. The tree as a whole is that over the first
    /// `shown` groups, at least one; the others are found from their own roots alone.
    pub(super) fn over(mesh: Mesh<'_>, mut groups: Vec<Vec<u32>>, shown: usize) -> (Self, Vec<u32>) {
        let center = |t: u32| {
            let [a, b, c] = mesh.corners(t);
            [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0)
        };
        let centers: Vec<[f64; 3]> = (0_u32..).take(mesh.triangles.len()).map(center).collect();
        for group in &mut groups {
            sort(group, &centers);
        }
        let leaves = groups.iter().flat_map(|group| group.chunks(WIDTH)).map(|t| mesh.leaf(t)).collect();

        let held = groups.iter().map(|group| group.chunks(WIDTH).map(|t| mesh.around(t)).collect());
        let held: Vec<Vec<Bounds>> = held.collect();
        let coordinates = held.iter().flatten().flatten().flatten();
        let size = coordinates.fold(0.0, |most: f64, c| most.max(c.abs()));
        let wider =
            |[low, high]: &Bounds| [low.map(|c| c - ROUNDING * size), high.map(|c| c + ROUNDING * size)];
        let held: Vec<Vec<Bounds>> = held.iter().map(|boxes| boxes.iter().map(wider).collect()).collect();
        let mut nodes = Vec::new();
        let (bounds, roots) = match &held[..] {
            [one] => (enclose(one, 0, &mut nodes), vec![ROOT]),
            _ => enclose_groups(&held, shown, &mut nodes),
        };
        let tree = Self {
            leaves,
            nodes,
            bounds,
            #[cfg(test)]
            looks: Looks::default(),
        };
        (tree, roots)
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
        self.nearest_below([ROOT, NONE], p)
    }

    /// The same of the groups that have these roots: the second may be [`NONE`].
    pub(super) fn nearest_below(&self, roots: [u32; 2], p: [f64; 3]) -> Option<(f64, Leaf)> {
        dispatch(Nearest { tree: self, roots, p, best: Best::none() })
    }

    /// The nearest of a triangle and the group with this root.
    pub(super) fn nearest_of(&self, known: Leaf, root: u32, p: [f64; 3]) -> Option<(f64, Leaf)> {
        let triangles = &self.leaves[known.leaf];
        let number = triangles.number[known.lane];
        let best = Best { square: triangles.place(known.lane, p).square, number, leaf: Some(known) };
        dispatch(Nearest { tree: self, roots: [root, NONE], p, best })
    }

    /// Whether a triangle of the group with this root, no farther from a point (m) than the root of `square` (m²), is wanted; asks
    /// for each by its number until one is.
    pub(super) fn any_within(
        &self,
        root: u32,
        p: [f64; 3],
        square: f64,
        mut is_wanted: impl FnMut(u32) -> bool,
    ) -> bool {
        let mut waiting = [root; DEPTH];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let child = waiting[count];
            if child & LEAF != 0 {
                let triangles = &self.leaves[(child & !LEAF) as usize];
                let squares = triangles.squares(p).into_iter().zip(triangles.number);
                let mut near = squares.filter(|(other, _)| may_hold(*other, square));
                if near.any(|(_, number)| is_wanted(number)) {
                    return true;
                }
                continue;
            }
            let node = &self.nodes[child as usize];
            let Four(besides) = node.beside(p);
            for (beside, child) in besides.into_iter().zip(node.children) {
                if child != NONE && may_hold(beside, square) {
                    waiting[count] = child;
                    count += 1;
                }
            }
        }
        false
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
#[derive(Clone, Copy)]
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
    /// Where it begins: one place, or two.
    roots: [u32; 2],
    p: [f64; 3],
    /// What it begins with.
    best: Best,
}

impl WithSimd<f64> for Nearest<'_> {
    const WIDE_BINARY64: bool = false;
    type Output = Option<(f64, Leaf)>;

    #[inline(always)]
    fn run<P: Pack<Number = f64>>(self) -> Self::Output {
        let Self { tree, roots, p, mut best } = self;
        let mut waiting = [(0.0_f64, 0_u32); DEPTH];
        waiting[0].1 = roots[0];
        let mut count = 1;
        if roots[1] != NONE {
            waiting[1].1 = roots[1];
            count = 2;
        }
        while count > 0 {
            count -= 1;
            let (square, child) = waiting[count];
            if !may_hold(square, best.square) {
                continue;
            }
            #[cfg(test)]
            tree.looks.add();
            if child & LEAF != 0 {
                best.look(tree, (child & !LEAF) as usize, p);
                continue;
            }
            tree.nodes[child as usize].children(p, best.square, &mut waiting, &mut count);
        }
        best.found()
    }
}

/// Writes the node over the groups that are shown, each of which is given by the boxes of its leaves, and those below it, then the
/// nodes of the others; gives the box around those shown and the root of each group.
fn enclose_groups(held: &[Vec<Bounds>], shown: usize, nodes: &mut Vec<Node>) -> (Bounds, Vec<u32>) {
    let boxes: Vec<Bounds> = held[..shown].iter().map(|boxes| around(boxes.iter().copied())).collect();
    let order = sorted(&boxes);
    let boxes: Vec<Bounds> = order.iter().map(|group| boxes[*group as usize]).collect();
    let bounds = enclose(&boxes, 0, nodes);
    let upper = nodes.len();
    let (mut roots, mut first) = (Vec::with_capacity(held.len()), 0);
    for boxes in held {
        if boxes.len() == 1 {
            roots.push(first as u32 | LEAF);
        } else {
            roots.push(nodes.len() as u32);
            enclose(boxes, first, nodes);
        }
        first += boxes.len();
    }
    // What stood for a group is its root.
    for child in nodes[..upper].iter_mut().flat_map(|node| &mut node.children) {
        if *child != NONE && *child & LEAF != 0 {
            *child = roots[order[(*child & !LEAF) as usize] as usize];
        }
    }
    (bounds, roots)
}
