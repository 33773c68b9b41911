//! Where parts of a surface pass through themselves: edges that cross triangles of the same part, counted exactly, and the first.
//!
//! Reads the triangles of each part (m). Where very many of them are near each other, the search ends early, and says so.

use super::{
    boxes::{Bounds, around},
    bundles::Bundles,
    tree::Mesh,
};
use crate::{
    interrupt,
    math::{
        array::{cross, dot, minus},
        vec3,
    },
    surface::{comes_to, crosses},
};

/// Looks that a search makes at most, and how many more for each triangle; a sound surface takes some hundred for each.
const MOST_LOOKS: u64 = 1 << 26;
const LOOKS_PER_TRIANGLE: u64 = 128;
/// How many of them it counts as to see whether one of two triangles crosses the other.
const PAIR: u64 = 8;

/// How often parts of a surface pass through themselves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SelfCrossings {
    /// Pairs of an edge and a triangle of the same part that it crosses, of those that share no point.
    pub count: u64,
    /// The first of them: in the order of the lower of the two triangles that it belongs to, then of the other.
    pub first: Option<FirstCrossing>,
    /// Whether so many triangles are near each other that not all of them were looked at: there may be more.
    pub is_cut_off: bool,
}

/// A place where an edge of a triangle crosses another triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstCrossing {
    /// The two triangles, the lower number first.
    pub triangles: [u32; 2],
    /// The place (m).
    pub place: [f64; 3],
}

/// What looks for crossings.
pub(super) struct Search<'a> {
    mesh: Mesh<'a>,
    /// Looks that are left.
    left: u64,
    pub(super) found: SelfCrossings,
}

/// A part that passes through itself.
pub(super) struct CrossedPart {
    pub(super) bundles: Bundles,
    /// Corners of the triangles that others of the part cross or touch, ascending.
    pub(super) reached: Vec<u32>,
    /// Whether all of it was looked at.
    pub(super) is_whole: bool,
}

impl<'a> Search<'a> {
    /// Of a surface of which nothing is known yet.
    pub(super) fn new(mesh: Mesh<'a>) -> Self {
        let left = MOST_LOOKS + LOOKS_PER_TRIANGLE * mesh.triangles.len() as u64;
        Self { mesh, left, found: SelfCrossings::default() }
    }

    /// Looks at the triangles of a part; gives what is known of it if it passes through itself.
    pub(super) fn part(&mut self, triangles: &[u32]) -> Option<CrossedPart> {
        let bundles = Bundles::new(self.mesh, triangles);
        let (before, mut reached) = (self.found.count, Vec::new());
        for t in triangles {
            interrupt::point();
            if !self.spend(1) {
                break;
            }
            self.look(*t, &bundles, &mut reached);
        }
        if self.found.count == before {
            return None;
        }
        reached.sort_unstable();
        reached.dedup();
        Some(CrossedPart { bundles, reached, is_whole: !self.found.is_cut_off })
    }

    /// Looks at a triangle: which others its edges cross. Of the two triangles of an edge, that one looks in which it ascends.
    fn look(&mut self, t: u32, bundles: &Bundles, reached: &mut Vec<u32>) {
        let mesh = self.mesh;
        let (corners @ [a, b, c], own) = (mesh.triangles[t as usize], mesh.around(&[t]));
        let edges = [[a, b], [b, c], [c, a]];
        bundles.meeting(own, |other| {
            let triangle = mesh.triangles[other as usize];
            if other == t || !self.spend(1) || !do_meet(own, mesh.corners(other)) || !self.spend(PAIR) {
                return;
            }
            let places = mesh.corners(other).map(vec3::<f64>);
            for edge in edges.into_iter().filter(|[from, to]| from < to) {
                if edge.iter().any(|end| triangle.contains(end)) {
                    continue;
                }
                let ends = edge.map(|end| vec3::<f64>(mesh.points[end as usize]));
                if comes_to(ends, places) {
                    reached.extend(corners.into_iter().chain(triangle));
                    if crosses(ends, places) {
                        self.found.add(
                            [t, other],
                            edge.map(|end| mesh.points[end as usize]),
                            mesh.corners(other),
                        );
                    }
                }
            }
        });
    }

    /// Takes looks of those that are left; whether there are so many.
    fn spend(&mut self, looks: u64) -> bool {
        let is_enough = looks <= self.left;
        self.left = if is_enough { self.left - looks } else { 0 };
        self.found.is_cut_off |= !is_enough;
        is_enough
    }
}

impl SelfCrossings {
    /// Counts one: an edge (m) of the first of two triangles and the corners (m) of the second.
    fn add(&mut self, [t, other]: [u32; 2], [p, q]: [[f64; 3]; 2], [a, b, c]: [[f64; 3]; 3]) {
        self.count += 1;
        let triangles = [t.min(other), t.max(other)];
        if self.first.is_some_and(|first| first.triangles <= triangles) {
            return;
        }
        let normal = cross(minus(b, a), minus(c, a));
        let [above, below] = [p, q].map(|end| dot(normal, minus(end, a)));
        let share = above / (above - below);
        let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.5 };
        let place = [0, 1, 2].map(|k| p[k] + share * (q[k] - p[k]));
        self.first = Some(FirstCrossing { triangles, place });
    }
}

/// Whether the box around a triangle (m) meets another box (m).
fn do_meet([low, high]: Bounds, corners: [[f64; 3]; 3]) -> bool {
    let [from, to] = around(corners.iter().map(|p| [*p; 2]));
    (0..3).all(|c| from[c] <= high[c] && low[c] <= to[c])
}
