//! Triangles of a surface, each vertex and each edge owned by one of them: the first that has it.
//!
//! Reads triangles by the numbers of their corners. Where all pairs of triangles are looked at, and of each only the parts
//! that it owns, every pair of parts is met once.

use crate::mesh::{is_degenerate, sorted};

/// How many parts a triangle has of each kind.
const PARTS: usize = 3;
/// The bit that says that a triangle is a figure's, behind those of its parts.
const FIGURE: usize = 2 * PARTS;

/// The triangles of a surface and what each owns.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Faces {
    triangles: Vec<[u32; 3]>,
    /// Of each triangle the corners that it owns, bits 0 to 2, and the edges, bits 3 to 5; and bit 6 of those of figures.
    owned: Vec<u8>,
    points: usize,
    /// Where the triangles of each point begin in `about`, and the end.
    starts: Vec<u32>,
    about: Vec<u32>,
}

impl Faces {
    /// Triangles in the order given, over `points` particles; those that name a particle twice are left out.
    ///
    /// # Panics
    /// When a triangle names a particle that is not below `points`.
    pub fn new(triangles: &[[u32; 3]], points: usize) -> Self {
        let triangles: Vec<[u32; 3]> = triangles.iter().filter(|t| !is_degenerate(t)).copied().collect();
        let mut owned = vec![0_u8; triangles.len()];

        let mut is_owned = vec![false; points];
        for (triangle, owned) in triangles.iter().zip(&mut owned) {
            for (corner, point) in triangle.iter().enumerate() {
                let is_owned = &mut is_owned[*point as usize];
                *owned |= u8::from(!*is_owned) << corner;
                *is_owned = true;
            }
        }

        let edges = (0..PARTS * triangles.len()).map(|place| {
            let [a, b] = ends(&triangles[place / PARTS], place % PARTS);
            (a.min(b), (a.max(b), place))
        });
        let mut last = None;
        for (a, (b, place)) in sorted(edges, points) {
            if last != Some((a, b)) {
                owned[place / PARTS] |= 1 << (PARTS + place % PARTS);
            }
            last = Some((a, b));
        }
        let mut starts = vec![0_u32; points + 1];
        for point in triangles.as_flattened() {
            starts[*point as usize + 1] += 1;
        }
        for point in 0..points {
            starts[point + 1] += starts[point];
        }
        let (mut about, mut next) = (vec![0_u32; 3 * triangles.len()], starts.clone());
        for (number, triangle) in triangles.iter().enumerate() {
            for point in triangle {
                let place = &mut next[*point as usize];
                about[*place as usize] = number as u32;
                *place += 1;
            }
        }
        Self { triangles, owned, points, starts, about }
    }

    /// The same triangles, of which those whose first corner is a figure's do not meet each other.
    #[must_use]
    pub fn with_figures(mut self, is_figure: impl Fn(u32) -> bool) -> Self {
        for (triangle, owned) in self.triangles.iter().zip(&mut self.owned) {
            *owned |= u8::from(is_figure(triangle[0])) << FIGURE;
        }
        self
    }

    /// Whether a triangle is a figure's.
    #[inline]
    pub fn is_figure(&self, triangle: usize) -> bool {
        (self.owned[triangle] >> FIGURE) & 1 == 1
    }

    /// Whether two triangles meet each other: not those of figures.
    #[inline]
    pub(super) fn meet(&self, one: usize, other: usize) -> bool {
        !(self.is_figure(one) && self.is_figure(other))
    }

    /// The triangles that have a particle for a corner, ascending.
    #[inline]
    pub fn about(&self, point: u32) -> &[u32] {
        let point = point as usize;
        &self.about[self.starts[point] as usize..self.starts[point + 1] as usize]
    }

    /// The third corners of the triangles that have an edge.
    #[inline]
    pub fn across(&self, [from, to]: [u32; 2]) -> impl Iterator<Item = u32> {
        let with = self.about(from).iter().map(|triangle| self.triangles[*triangle as usize]);
        with.filter(move |corners| corners.contains(&to)).flat_map(move |corners| {
            corners.into_iter().filter(move |corner| *corner != from && *corner != to)
        })
    }

    /// The triangles, by the numbers of their corners.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// How many particles there are, whether triangles name them or not.
    pub fn points(&self) -> usize {
        self.points
    }

    /// Whether a triangle is the one that owns the vertex at one of its corners (0 to 2).
    #[inline]
    pub fn owns_vertex(&self, triangle: usize, corner: usize) -> bool {
        (self.owned[triangle] >> corner) & 1 == 1
    }

    /// Whether a triangle is the one that owns one of its edges: edge k joins corners k and (k + 1) % 3.
    #[inline]
    pub fn owns_edge(&self, triangle: usize, edge: usize) -> bool {
        (self.owned[triangle] >> (PARTS + edge)) & 1 == 1
    }

    /// The corners that a triangle owns.
    #[inline]
    pub(super) fn vertices(&self, triangle: usize) -> impl Iterator<Item = u32> {
        let corners = self.triangles[triangle];
        (0..PARTS)
            .filter(move |corner| self.owns_vertex(triangle, *corner))
            .map(move |corner| corners[corner])
    }

    /// The ends of the edges that a triangle owns.
    #[inline]
    pub(super) fn edges(&self, triangle: usize) -> impl Iterator<Item = [u32; 2]> {
        let corners = self.triangles[triangle];
        (0..PARTS).filter(move |edge| self.owns_edge(triangle, *edge)).map(move |edge| ends(&corners, edge))
    }
}

/// The ends of an edge of a triangle.
fn ends(triangle: &[u32; 3], edge: usize) -> [u32; 2] {
    [triangle[edge], triangle[(edge + 1) % PARTS]]
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use super::*;

    /// Triangles of few points, so that much is shared, turned or repeated; without order.
    fn jumble(count: u32, points: u32) -> Vec<[u32; 3]> {
        let mut state = 77_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) % points
        };
        (0..count).map(|_| [next(), next(), next()]).collect()
    }

    #[test]
    fn each_vertex_and_each_edge_is_owned_once_by_the_first_that_has_it() {
        for (count, points) in [(0, 5), (1, 9), (40, 9), (3000, 60)] {
            let given = jumble(count, points);
            let faces = Faces::new(&given, points as usize);
            let sound = given.iter().filter(|t| BTreeSet::from(**t).len() == 3);
            assert_eq!(faces.triangles(), sound.copied().collect::<Vec<_>>());

            let (mut vertices, mut edges) = (BTreeMap::new(), BTreeMap::new());
            for (number, triangle) in faces.triangles().iter().enumerate() {
                for k in 0..3 {
                    let [a, b] = ends(triangle, k);
                    let vertex = *vertices.entry(a).or_insert((number, k));
                    assert_eq!(faces.owns_vertex(number, k), vertex == (number, k), "{triangle:?}");
                    let edge = *edges.entry([a.min(b), a.max(b)]).or_insert((number, k));
                    assert_eq!(faces.owns_edge(number, k), edge == (number, k), "{triangle:?}");
                }
            }
            let all = 0..faces.triangles().len();
            for (point, of_point) in (0..points).map(|point| (point, faces.about(point))) {
                let has = |t: &usize| faces.triangles()[*t].contains(&point);
                assert!(all.clone().filter(has).eq(of_point.iter().map(|t| *t as usize)), "{point}");
            }
            let mut owned: Vec<u32> = all.clone().flat_map(|t| faces.vertices(t)).collect();
            owned.sort_unstable();
            assert_eq!(owned, vertices.into_keys().collect::<Vec<_>>());
            let mut owned: Vec<[u32; 2]> =
                all.flat_map(|t| faces.edges(t)).map(|[a, b]| [a.min(b), a.max(b)]).collect();
            owned.sort_unstable();
            assert_eq!(owned, edges.into_keys().collect::<Vec<_>>());
        }
    }

    #[test]
    fn triangles_of_figures_meet_others_alone() {
        let triangles = [[0, 1, 2], [3, 4, 5], [4, 5, 6], [7, 8, 9]];
        let plain = Faces::new(&triangles, 10);
        let faces = plain.clone().with_figures(|corner| (3..7).contains(&corner));
        assert_eq!([0, 1, 2, 3].map(|face| faces.is_figure(face)), [false, true, true, false]);
        assert!(!faces.meet(1, 2) && faces.meet(0, 1) && faces.meet(2, 3) && faces.meet(0, 3));
        assert!(plain.meet(1, 2));
        for face in 0..4 {
            assert!(faces.vertices(face).eq(plain.vertices(face)) && faces.edges(face).eq(plain.edges(face)));
        }
    }

    #[test]
    fn two_triangles_share_an_edge_that_the_first_owns() {
        let faces = Faces::new(&[[5, 5, 1], [0, 1, 2], [2, 1, 3]], 6);
        assert_eq!(faces.triangles(), [[0, 1, 2], [2, 1, 3]]);
        assert_eq!([0, 1, 2].map(|k| faces.owns_vertex(1, k)), [false, false, true]);
        assert_eq!([0, 1, 2].map(|k| faces.owns_edge(1, k)), [false, true, true]);
        assert_eq!(faces.points(), 6);
        assert!(faces.across([1, 2]).eq([0, 3]) && faces.across([3, 1]).eq([2]));
        assert_eq!(faces.across([0, 3]).count(), 0);
    }
}
