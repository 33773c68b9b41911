//! Which triangles of a part lie wholly within another part: they are no surface of the union.
//!
//! Reads the triangles of each part; writes a mark for each of them, and for each part whether others are near it. A triangle is moved out of its own part by as good as nothing before it is looked at: where parts touch in a face, that face is
//! within the other one, and where faces of both lie in one plane beside each other, they stay surface. What a search that grows
//! too long leaves out counts as surface, which costs time and depth, and no side.

use super::{
    boxes::{Bounds, NONE},
    sides::Sides,
    tree::{Mesh, Tree},
};
use crate::{
    interrupt,
    math::{
        array::{length, minus},
        vec3,
    },
    surface::crosses,
};

/// How far a triangle is moved outwards, over the size of the mesh.
const ROOM: f64 = 1e-12;
/// Share by which it is made smaller: what touches its border does not cross it.
const SMALLER: f64 = 1e-9;
/// Triangles that are looked at, at most, and how many of them one question to a tree counts as.
const MOST_LOOKS: u64 = 1 << 25;
const QUESTION: u64 = 32;
/// How many of them a look for a crossing counts as.
const CROSSING: u64 = 4;

/// What was found.
pub(super) struct Buried {
    /// Of each part, whether its box meets that of another.
    pub(super) near_others: Vec<bool>,
    /// Of each triangle, whether it is wholly within a part that is not its own.
    pub(super) triangles: Vec<bool>,
}

/// What looks for parts near others, and for triangles within them.
struct Search<'a> {
    mesh: Mesh<'a>,
    sides: Sides<'a>,
    parts: &'a [Vec<u32>],
    /// Over all parts, each with a root and a box (m).
    tree: Tree,
    roots: Vec<u32>,
    bounds: Vec<Bounds>,
    /// Looks that are left.
    left: u64,
    found: Buried,
}

impl Buried {
    /// Of the triangles of each part.
    pub(super) fn new(mesh: Mesh<'_>, sides: Sides<'_>, parts: &[Vec<u32>]) -> Self {
        let (tree, roots) = Tree::over(mesh, parts.to_vec(), parts.len());
        let bounds: Vec<Bounds> = parts.iter().map(|part| mesh.around(part)).collect();
        let found =
            Self { near_others: vec![false; parts.len()], triangles: vec![false; mesh.triangles.len()] };
        let mut search = Search { mesh, sides, parts, tree, roots, bounds, left: MOST_LOOKS, found };
        search.run();
        search.found
    }
}

impl Search<'_> {
    /// Looks at all pairs of parts whose boxes meet.
    fn run(&mut self) {
        let room = ROOM * self.sides.size;
        let mut order: Vec<usize> = (0..self.parts.len()).collect();
        order.sort_by(|a, b| self.bounds[*a][0][0].total_cmp(&self.bounds[*b][0][0]));
        for (place, a) in order.iter().copied().enumerate() {
            interrupt::point();
            for b in order[place + 1..].iter().copied() {
                let ([low, high], [from, to]) = (self.bounds[a], self.bounds[b]);
                if from[0] > high[0] + room {
                    break;
                }
                if (1..3).all(|c| from[c] <= high[c] + room && low[c] <= to[c] + room) {
                    self.found.near_others[a] = true;
                    self.found.near_others[b] = true;
                    self.look(a, b);
                    self.look(b, a);
                }
            }
        }
    }

    /// Looks which triangles of a part are within another one.
    fn look(&mut self, part: usize, other: usize) {
        let room = ROOM * self.sides.size;
        let [low, high] = self.bounds[other];
        let parts = self.parts;
        for t in &parts[part] {
            if self.left == 0 {
                return;
            }
            self.left -= 1;
            let corners = self.mesh.corners(*t);
            let may_be =
                corners.iter().all(|p| (0..3).all(|c| low[c] <= p[c] + room && p[c] <= high[c] + room));
            if may_be && !self.found.triangles[*t as usize] && self.is_within(*t, other) {
                self.found.triangles[*t as usize] = true;
            }
        }
    }

    /// Whether a triangle is wholly within a part.
    fn is_within(&mut self, t: u32, part: usize) -> bool {
        interrupt::point();
        let (mesh, sides, root) = (self.mesh, self.sides, self.roots[part]);
        let out = mesh.faces[t as usize].map(|c| ROOM * sides.size * c);
        let [a, b, c] = mesh.corners(t);
        let middle = [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0);
        let corners = [a, b, c].map(|p| [0, 1, 2].map(|k| p[k] + SMALLER * (middle[k] - p[k]) + out[k]));
        let middle = [0, 1, 2].map(|k| middle[k] + out[k]);
        self.left = self.left.saturating_sub(QUESTION);
        let Some((_, leaf)) = self.tree.nearest_below([root, NONE], middle) else { return false };
        let (distance, _) = sides.at(&self.tree, leaf, middle);
        if distance >= 0.0 {
            return false;
        }
        let reach = corners.iter().map(|p| length(minus(*p, middle))).fold(0.0, f64::max);
        if -distance > reach {
            return true;
        }
        let mut looks = 0;
        let is_crossed = self.tree.any_within(root, middle, reach * reach, |other| {
            looks += CROSSING;
            cross_each_other(corners, mesh.corners(other))
        });
        self.left = self.left.saturating_sub(looks);
        !is_crossed
    }
}

/// Whether an edge of one of two triangles crosses the other one.
fn cross_each_other(a: [[f64; 3]; 3], b: [[f64; 3]; 3]) -> bool {
    let [a, b] = [a, b].map(|corners| corners.map(vec3::<f64>));
    [(a, b), (b, a)]
        .into_iter()
        .any(|([p, q, r], other)| [[p, q], [q, r], [r, p]].into_iter().any(|edge| crosses(edge, other)))
}
