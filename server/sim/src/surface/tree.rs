//! A tree of boxes over triangles that move, and the pairs of their parts whose boxes meet.
//!
//! Reads boxes (m) in each call; writes pairs by the numbers of particles. The triangles stand in the order given: four
//! neighbours make a node, and four neighbours among the nodes of a level one of the next. So the tree follows from the
//! number of triangles alone, and only its boxes are made anew.

use super::{
    bounds::{Bounds, Four, WIDTH},
    distance::PairKind,
    faces::Faces,
};
use crate::parallel::{Own, between_mut, per_block, per_block_mut, per_row_mut};

/// Levels that every tree has: a block of triangles has a node of its own.
const LEAST_LEVELS: usize = 3;
/// Triangles that are searched from at once: those of a node of the third level.
const BLOCK: usize = WIDTH * WIDTH * WIDTH;
/// Nodes, or particles, that a thread makes boxes for at a time.
const PIECE: usize = 256;

/// Two parts of triangles that may come close.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Candidate {
    /// Which parts they are.
    pub kind: PairKind,
    /// The vertex, then the corners of the triangle; or the two ends of one edge, then of the other.
    pub corners: [u32; 4],
    /// Number of the triangle among the faces; `u32::MAX` of two edges.
    pub triangle: u32,
}

/// Which pairs are wanted of those whose boxes meet.
#[derive(Clone, Copy)]
pub struct Wanted<'a> {
    /// The triangles, ascending, of which none has a part that makes a pair with one of a triangle.
    pub without: &'a (dyn Fn(usize) -> &'a [u32] + Sync),
    /// Whether a pair is wanted, by its corners as they stand in a [`Candidate`].
    pub is_wanted: &'a (dyn Fn(PairKind, [u32; 4]) -> bool + Sync),
}

/// Candidates of a block of triangles, at most, but for those of one more triangle: 500 per triangle. Cloth in piles of twenty has some 100.
const MOST: usize = 500 * BLOCK;

/// So many parts come close that their pairs are too many.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crowded {
    /// The first triangle of the first block of which that is so.
    pub triangle: usize,
}

/// Stands in room for candidates before they are written.
const NOTHING: Candidate = Candidate { kind: PairKind::Edges, corners: [0; 4], triangle: u32::MAX };

/// Boxes over the triangles of a surface.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    faces: usize,
    /// The nodes of each level: boxes of four triangles first, then of four nodes of the level before; one node at last.
    levels: Vec<Vec<Four>>,
    /// What boxes are seen from (m): a place at the surface, so that they are as narrow far from the origin of the scene.
    origin: [f64; 3],
    /// The box of each particle, widened, while candidates are looked for.
    corners: Vec<Bounds>,
    found: Vec<Found>,
    starts: Vec<u32>,
}

/// What is found from a block of triangles, with room for the search.
#[derive(Clone, Debug, Default)]
struct Found {
    candidates: Vec<Candidate>,
    search: Search,
}

/// Nodes that may have something for what is searched from.
#[derive(Clone, Debug, Default)]
struct Search {
    /// Level and number of those that wait to be looked at.
    waiting: Vec<(usize, usize)>,
    /// Those of 64 triangles for as many, then those of 16 for as many, then those of 4 for as many.
    near: [Vec<usize>; LEAST_LEVELS],
    partners: Vec<usize>,
}

impl Tree {
    /// A tree over so many triangles, without boxes yet: nothing meets.
    pub fn new(faces: usize) -> Self {
        let (mut levels, mut count) = (Vec::new(), faces);
        while levels.len() < LEAST_LEVELS || count > 1 {
            count = count.div_ceil(WIDTH);
            levels.push(vec![Four::NONE; count]);
        }
        let found = vec![Found::default(); faces.div_ceil(BLOCK)];
        Self { faces, levels, found, ..Self::default() }
    }

    /// Makes the boxes anew: `boxes` gives the lower and the upper corner (m) of that of a triangle, finite numbers.
    pub fn refit(&mut self, boxes: &(dyn Fn(usize) -> [[f64; 3]; 2] + Sync)) {
        if self.faces == 0 {
            return;
        }
        let (faces, origin) = (self.faces, boxes(0)[0]);
        self.origin = origin;
        Own::whole(self.levels[0].len(), PIECE).each(per_row_mut(&mut self.levels[0]), |piece, nodes| {
            for (i, node) in nodes.iter_mut().enumerate() {
                let first = (piece * PIECE + i) * WIDTH;
                for face in first..faces.min(first + WIDTH) {
                    node.set(face - first, &Bounds::around(boxes(face), origin));
                }
            }
        });
        for level in 1..self.levels.len() {
            let (below, nodes) = self.levels.split_at_mut(level);
            let below = &below[level - 1];
            Own::whole(nodes[0].len(), PIECE).each(per_row_mut(&mut nodes[0]), |piece, nodes| {
                for (i, node) in nodes.iter_mut().enumerate() {
                    let first = (piece * PIECE + i) * WIDTH;
                    for child in first..below.len().min(first + WIDTH) {
                        node.set(child - first, &below[child].all());
                    }
                }
            });
        }
    }

    /// Writes all pairs of a vertex with a triangle and of an edge with an edge whose boxes meet, each once; in the order of
    /// the first triangle, then of the second.
    ///
    /// `part_box` gives the box (m, finite numbers) about the way of a particle, already widened; it is asked of one particle
    /// at a time, and the box of an edge or of a triangle is that around the boxes of its corners. [`Self::refit`] has had
    /// the same boxes. Left out are pairs that share a particle, and those that are not wanted.
    ///
    /// # Errors
    /// Where parts crowd so much that they would not fit into memory: no list is written then.
    ///
    /// # Panics
    /// When the faces are not as many as the tree is over.
    pub fn candidates(
        &mut self,
        faces: &Faces,
        wanted: &Wanted<'_>,
        part_box: &(dyn Fn(&[u32]) -> [[f64; 3]; 2] + Sync),
        out: &mut Vec<Candidate>,
    ) -> Result<(), Crowded> {
        assert_eq!(faces.triangles().len(), self.faces, "a tree over these faces");
        let origin = self.origin;
        self.corners.resize(faces.points(), Bounds::NONE);
        Own::whole(faces.points(), PIECE).each(per_row_mut(&mut self.corners), |piece, corners| {
            for (point, corner) in (piece * PIECE..).zip(corners) {
                *corner = Bounds::around(part_box(&[point as u32]), origin);
            }
        });

        let pairs = Pairs { faces, corners: &self.corners, wanted };
        let levels = &self.levels;
        Own::whole(self.found.len(), 1).each(per_block_mut(&mut self.found), |block, found| {
            let Found { candidates, search } = found;
            candidates.clear();
            search.partners(levels, self.faces, block, |face, partners| {
                if candidates.len() <= MOST {
                    pairs.add(face, partners, candidates);
                }
            });
        });
        if let Some(block) = self.found.iter().position(|found| found.candidates.len() > MOST) {
            return Err(Crowded { triangle: block * BLOCK });
        }

        self.starts.clear();
        self.starts.push(0);
        let mut count = 0;
        for found in &self.found {
            count += found.candidates.len();
            self.starts.push(u32::try_from(count).expect("candidates that can be numbered"));
        }
        out.resize(count, NOTHING);
        let fields = (between_mut(out, &self.starts), per_block(&self.found));
        Own::whole(self.found.len(), 1)
            .each(fields, |_, (out, found)| out.copy_from_slice(&found.candidates));
        Ok(())
    }

    /// Calls `each` for the triangles with those of greater number whose boxes meet theirs, ascending, and with what is left of
    /// their block, which is made anew.
    pub(super) fn partners<T: Default + Send>(
        &mut self,
        left: &mut Vec<T>,
        each: impl Fn(&mut T, usize, &[usize]) + Sync,
    ) {
        let Self { faces, levels, found, .. } = self;
        let blocks = found.len();
        left.clear();
        left.resize_with(blocks, T::default);
        let fields = (per_block_mut(left), per_block_mut(found));
        Own::whole(blocks, 1).each(fields, |block, (left, found)| {
            found.search.partners(levels, *faces, block, |face, partners| each(left, face, partners));
        });
    }
}

impl Search {
    /// Calls `each` for the triangles of a block with those of greater number whose boxes meet theirs, ascending.
    fn partners(
        &mut self,
        levels: &[Vec<Four>],
        faces: usize,
        block: usize,
        mut each: impl FnMut(usize, &[usize]),
    ) {
        self.descend(levels, block);
        let Self { near: [by_64, by_16, by_4], partners, .. } = self;
        for p in WIDTH * block..levels[1].len().min(WIDTH * (block + 1)) {
            meet(&levels[2], by_64, &levels[2][block].get(p % WIDTH), p, by_16);
            for f in WIDTH * p..levels[0].len().min(WIDTH * (p + 1)) {
                meet(&levels[1], by_16, &levels[1][p].get(f % WIDTH), f, by_4);
                for face in WIDTH * f..faces.min(WIDTH * (f + 1)) {
                    meet(&levels[0], by_4, &levels[0][f].get(face % WIDTH), face + 1, partners);
                    if !partners.is_empty() {
                        each(face, partners);
                    }
                }
            }
        }
    }

    /// Finds the nodes of 64 triangles whose boxes meet that of a block, from its own on.
    fn descend(&mut self, levels: &[Vec<Four>], block: usize) {
        let Self { waiting, near: [by_64, ..], .. } = self;
        by_64.clear();
        let last = LEAST_LEVELS - 1;
        let own = levels[last][block].all();
        waiting.push((levels.len() - 1, 0));
        while let Some((level, node)) = waiting.pop() {
            if level == last {
                by_64.push(node);
                continue;
            }
            let met = levels[level][node].met_by(&own);
            for lane in (0..WIDTH).rev().filter(|lane| (met >> lane) & 1 == 1) {
                let child = WIDTH * node + lane;
                let end = (child + 1) << (2 * (level - LEAST_LEVELS));
                if end > block {
                    waiting.push((level - 1, child));
                }
            }
        }
    }
}

/// Of some nodes of a level, the children from `first` on whose boxes meet one.
#[inline(always)]
fn meet(level: &[Four], nodes: &[usize], bounds: &Bounds, first: usize, children: &mut Vec<usize>) {
    children.clear();
    for node in nodes {
        let mut met = level[*node].met_by(bounds);
        while met != 0 {
            let child = WIDTH * node + met.trailing_zeros() as usize;
            met &= met - 1;
            if child >= first {
                children.push(child);
            }
        }
    }
}

/// The parts of triangles, with their boxes.
struct Pairs<'a, 'b> {
    faces: &'a Faces,
    corners: &'a [Bounds],
    wanted: &'a Wanted<'b>,
}

impl Pairs<'_, '_> {
    /// Adds the pairs of parts that a triangle makes with others.
    fn add(&self, face: usize, partners: &[usize], candidates: &mut Vec<Candidate>) {
        let triangles = self.faces.triangles();
        let own = self.around(&triangles[face]);
        let mut edges = [([0; 2], Bounds::NONE); 3];
        let mut count = 0;
        for (place, edge) in self.faces.edges(face).enumerate() {
            edges[place] = (edge, self.around(&edge));
            count = place + 1;
        }
        let mut add = |kind, corners: [u32; 4], triangle| {
            if (self.wanted.is_wanted)(kind, corners) {
                candidates.push(Candidate { kind, corners, triangle });
            }
        };
        let mut without = (self.wanted.without)(face);
        for other in partners {
            while without.first().is_some_and(|first| (*first as usize) < *other) {
                without = &without[1..];
            }
            if without.first().is_some_and(|first| *first as usize == *other) {
                continue;
            }
            let around = self.around(&triangles[*other]);
            for (from, to, bounds) in [(face, *other, &around), (*other, face, &own)] {
                let [a, b, c] = triangles[to];
                for v in self.faces.vertices(from) {
                    if v != a && v != b && v != c && self.corners[v as usize].meets(bounds) {
                        add(PairKind::VertexTriangle, [v, a, b, c], to as u32);
                    }
                }
            }
            for [c, d] in self.faces.edges(*other) {
                let around = self.around(&[c, d]);
                for (edge, bounds) in &edges[..count] {
                    let [a, b] = *edge;
                    if a != c && a != d && b != c && b != d && bounds.meets(&around) {
                        add(PairKind::Edges, [a, b, c, d], u32::MAX);
                    }
                }
            }
        }
    }

    /// The box around some particles.
    #[inline(always)]
    fn around<const N: usize>(&self, points: &[u32; N]) -> Bounds {
        points.iter().fold(Bounds::NONE, |bounds, point| bounds.and(self.corners[*point as usize]))
    }
}
