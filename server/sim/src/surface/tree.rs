//! A tree of boxes over triangles that move, and the pairs of their parts whose boxes meet.
//!
//! Reads boxes (m) in each call; writes pairs by the numbers of particles. The triangles stand in the order given: four
//! neighbours make a node, and four neighbours among the nodes of a level one of the next. So the tree follows from the
//! number of triangles alone, and only its boxes are made anew.

use std::{
    ops::ControlFlow,
    sync::atomic::{AtomicUsize, Ordering},
};

use super::{
    bounds::{Bounds, Four, WIDTH},
    distance::PairKind,
    faces::Faces,
    search::{BLOCK, LEAST_LEVELS, Search, search},
};
use crate::{
    interrupt::{Interrupt, Interrupted},
    parallel::{Own, between_mut, per_block, per_row_mut},
};

/// Nodes, or particles, that a thread makes boxes for at a time.
const PIECE: usize = 256;

/// Two parts of triangles that may come close.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Candidate {
    /// The vertex, then the corners of the triangle; or the two ends of one edge, then of the other.
    pub corners: [u32; 4],
    /// Number of the triangle among the faces; `u32::MAX` of two edges.
    pub triangle: u32,
}

impl Candidate {
    /// Which parts they are.
    #[inline(always)]
    pub fn kind(&self) -> PairKind {
        if self.triangle == u32::MAX { PairKind::Edges } else { PairKind::VertexTriangle }
    }
}

/// Which pairs are wanted of those whose boxes meet.
#[derive(Clone, Copy)]
pub struct Wanted<'a> {
    /// The triangles, ascending, of which none has a part that makes a pair with one of a triangle.
    pub without: &'a (dyn Fn(usize) -> &'a [u32] + Sync),
    /// Whether a pair is wanted, by its corners as they stand in a [`Candidate`].
    pub is_wanted: &'a (dyn Fn(PairKind, [u32; 4]) -> bool + Sync),
}

/// Candidates of a block of triangles, at most, but for those of one more go: 500 per triangle. Cloth in piles of twenty has some 100.
const MOST: usize = 500 * BLOCK;

/// Why there is no list of candidates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unlisted {
    /// So many parts come close that their pairs are too many.
    Crowded {
        /// The first triangle of the first block of which that is so.
        triangle: usize,
        /// So many pairs a block may have.
        most: usize,
    },
    /// The search was given up.
    Interrupted,
}

impl From<Interrupted> for Unlisted {
    fn from(_: Interrupted) -> Self {
        Self::Interrupted
    }
}

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
    /// Of each block of triangles.
    searches: Vec<Search>,
    /// Of each block too.
    lists: Vec<Listed>,
    starts: Vec<u32>,
}

/// What is found from a block of triangles.
#[derive(Clone, Debug, Default)]
struct Listed {
    candidates: Vec<Candidate>,
    /// How many there are, kept or not.
    count: usize,
}

/// How many candidates a search lists.
#[derive(Clone, Copy)]
struct Most {
    /// So many of a block: one that has more ends the search.
    of_block: usize,
    /// So many in all that are kept: more are counted alone.
    kept: usize,
}

impl Tree {
    /// A tree over so many triangles, without boxes yet: nothing meets.
    pub fn new(faces: usize) -> Self {
        let (mut levels, mut count) = (Vec::new(), faces);
        while levels.len() < LEAST_LEVELS || count > 1 {
            count = count.div_ceil(WIDTH);
            levels.push(vec![Four::NONE; count]);
        }
        let blocks = faces.div_ceil(BLOCK);
        let (searches, lists) = (vec![Search::default(); blocks], vec![Listed::default(); blocks]);
        Self { faces, levels, searches, lists, ..Self::default() }
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
    /// the same boxes. Left out are pairs that share a particle, those of figures, and those that are not wanted.
    ///
    /// # Errors
    /// Where parts crowd so much that they would not fit into memory, or the search is given up: no list is written then.
    ///
    /// # Panics
    /// When the faces are not as many as the tree is over.
    pub fn candidates(
        &mut self,
        faces: &Faces,
        wanted: &Wanted<'_>,
        part_box: &(dyn Fn(&[u32]) -> [[f64; 3]; 2] + Sync),
        out: &mut Vec<Candidate>,
        interrupt: &Interrupt,
    ) -> Result<(), Unlisted> {
        let count = self.find(faces, wanted, part_box, usize::MAX, interrupt)?;
        out.resize(count, Candidate::default());
        self.write(out, |out, candidate| *out = candidate);
        Ok(())
    }

    /// Finds what [`Self::candidates`] writes, for [`Self::write`], and returns how many pairs that are. Where they are more than `most`, no more
    /// than so many are kept, and memory is taken for these alone.
    ///
    /// # Errors
    /// As [`Self::candidates`], whatever `most` is.
    ///
    /// # Panics
    /// As [`Self::candidates`].
    pub fn find(
        &mut self,
        faces: &Faces,
        wanted: &Wanted<'_>,
        part_box: &(dyn Fn(&[u32]) -> [[f64; 3]; 2] + Sync),
        most: usize,
        interrupt: &Interrupt,
    ) -> Result<usize, Unlisted> {
        let most = Most { of_block: MOST, kept: most };
        match self.list(faces, wanted, part_box, most, interrupt)? {
            Some(block) => Err(Unlisted::Crowded { triangle: block * BLOCK, most: MOST }),
            None => Ok(self.lists.iter().map(|listed| listed.count).sum()),
        }
    }

    /// Writes each pair that was found last to its place of a list, in their order.
    ///
    /// # Panics
    /// When the list has more or fewer places than pairs are kept.
    pub fn write<T: Send>(&mut self, list: &mut [T], put: impl Fn(&mut T, Candidate) + Sync) {
        self.starts.clear();
        self.starts.push(0);
        let mut count = 0;
        for listed in &self.lists {
            count += listed.candidates.len();
            self.starts.push(u32::try_from(count).expect("candidates that can be numbered"));
        }
        assert_eq!(list.len(), count, "a place for each pair");
        let fields = (between_mut(list, &self.starts), per_block(&self.lists));
        Own::whole(self.lists.len(), 1).each(fields, |_, (places, listed)| {
            for (place, candidate) in places.iter_mut().zip(&listed.candidates) {
                put(place, *candidate);
            }
        });
    }

    /// Bytes that the pairs take which were found.
    pub(crate) fn bytes(&self) -> usize {
        self.lists.iter().map(|listed| listed.candidates.capacity()).sum::<usize>() * size_of::<Candidate>()
    }

    /// The first pair that [`Self::candidates`] would write, if any; nothing is looked for behind it.
    ///
    /// # Errors
    /// When the search is given up.
    ///
    /// # Panics
    /// When the faces are not as many as the tree is over.
    pub fn first_candidate(
        &mut self,
        faces: &Faces,
        wanted: &Wanted<'_>,
        part_box: &(dyn Fn(&[u32]) -> [[f64; 3]; 2] + Sync),
        interrupt: &Interrupt,
    ) -> Result<Option<Candidate>, Interrupted> {
        let most = Most { of_block: 0, kept: usize::MAX };
        let block = self.list(faces, wanted, part_box, most, interrupt)?;
        Ok(block.map(|block| self.lists[block].candidates[0]))
    }

    /// Lists the candidates of each block, up to the first block that has too many, and gives that one.
    fn list(
        &mut self,
        faces: &Faces,
        wanted: &Wanted<'_>,
        part_box: &(dyn Fn(&[u32]) -> [[f64; 3]; 2] + Sync),
        most: Most,
        interrupt: &Interrupt,
    ) -> Result<Option<usize>, Interrupted> {
        assert_eq!(faces.triangles().len(), self.faces, "a tree over these faces");
        let origin = self.origin;
        self.corners.resize(faces.points(), Bounds::NONE);
        Own::whole(faces.points(), PIECE).each(per_row_mut(&mut self.corners), |piece, corners| {
            for (point, corner) in (piece * PIECE..).zip(corners) {
                *corner = Bounds::around(part_box(&[point as u32]), origin);
            }
        });

        let Self { levels, corners, searches, lists, .. } = self;
        lists.iter_mut().for_each(Listed::clear);
        let (pairs, all) = (Pairs { faces, corners, wanted }, AtomicUsize::new(0));
        search(
            (levels, self.faces),
            searches,
            lists,
            interrupt,
            |Listed { candidates, count }: &mut Listed, face, partners| {
                let before = candidates.len();
                pairs.add(face, partners, candidates);
                let added = candidates.len() - before;
                *count += added;
                if added > 0 && all.fetch_add(added, Ordering::Relaxed) + added > most.kept {
                    candidates.truncate(before);
                }
                if *count > most.of_block { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            },
        )
    }

    /// Calls `each` for the triangles with those of greater number whose boxes meet theirs, ascending and some at a time, and with
    /// what is left of their block, which is made anew. What breaks off ends its block, and all blocks after it, which are not
    /// whole then.
    ///
    /// # Errors
    /// When the search is given up.
    pub(super) fn partners<T: Default + Send>(
        &mut self,
        left: &mut Vec<T>,
        interrupt: &Interrupt,
        each: impl Fn(&mut T, usize, &[usize]) -> ControlFlow<()> + Sync,
    ) -> Result<(), Interrupted> {
        left.clear();
        left.resize_with(self.searches.len(), T::default);
        search((&self.levels, self.faces), &mut self.searches, left, interrupt, each)?;
        Ok(())
    }
}

impl Listed {
    fn clear(&mut self) {
        self.candidates.clear();
        self.count = 0;
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
                candidates.push(Candidate { corners, triangle });
            }
        };
        let mut without = (self.wanted.without)(face);
        for other in partners {
            while without.first().is_some_and(|first| (*first as usize) < *other) {
                without = &without[1..];
            }
            if without.first().is_some_and(|first| *first as usize == *other)
                || !self.faces.meet(face, *other)
            {
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
