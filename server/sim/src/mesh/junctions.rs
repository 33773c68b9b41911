//! T-junctions: vertices of the border that lie on an open edge which does not name them.
//!
//! Reads open edges; gives how many such vertices there are and the first. Vertices are filed in cells as large as open edges are
//! long in the mean, and an edge is compared with those of the cells that it runs through.

use std::collections::BTreeMap;

use crate::{
    interrupt,
    math::array::{dot, length, minus},
};

/// Distance between a vertex and an edge on which it lies, at most, in lengths of the edge.
const NEAR: f64 = 1e-6;
/// Largest coordinate, in edges of a cell: cells are numbered exactly.
const FAR: f64 = 1e12;
/// Cells and vertices that are looked at for each edge, at most, and those that may be looked at besides.
const LOOKS_PER_EDGE: usize = 64;
const FREE_LOOKS: usize = 1 << 20;

/// An edge of one triangle alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct OpenEdge {
    pub(super) ends: [u32; 2],
    /// The third point of its triangle.
    pub(super) opposite: u32,
}

/// Vertices on open edges that do not name them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TJunctions {
    /// How many vertices that are.
    pub count: usize,
    /// The first of them, and the edge on which it lies.
    pub first: Option<(u32, [u32; 2])>,
    /// Whether the search was cut off, so that there may be more.
    pub is_cut_off: bool,
}

/// Looks for vertices of open edges on others of them.
pub(super) fn t_junctions(points: &[[f64; 3]], edges: &[OpenEdge]) -> TJunctions {
    let ends = |edge: &OpenEdge| edge.ends.map(|i| points[i as usize]);
    let lengths = edges.iter().map(|edge| {
        let [a, b] = ends(edge);
        length(minus(b, a))
    });
    let cell = lengths.sum::<f64>() / edges.len().max(1) as f64;
    if cell == 0.0 {
        return TJunctions::default();
    }
    let far = edges.iter().flat_map(ends).flatten().fold(0.0, |far, c| f64::max(far, c.abs()));
    if !cell.is_finite() || far > FAR * cell {
        return TJunctions { is_cut_off: true, ..TJunctions::default() };
    }

    let mut vertices: Vec<u32> = edges.iter().flat_map(|edge| edge.ends).collect();
    vertices.sort_unstable();
    vertices.dedup();
    let file = |vertex: u32| (points[vertex as usize].map(|c| number(c, cell)), vertex);
    let mut filed: Vec<([i64; 3], u32)> = vertices.into_iter().map(file).collect();
    filed.sort_unstable();

    let mut search = Search {
        points,
        filed,
        cell,
        left: FREE_LOOKS + LOOKS_PER_EDGE * edges.len(),
        found: BTreeMap::new(),
    };
    let is_cut_off = edges.iter().any(|edge| search.along(edge).is_none());
    TJunctions {
        count: search.found.len(),
        first: search.found.first_key_value().map(|(vertex, edge)| (*vertex, *edge)),
        is_cut_off,
    }
}

/// The number of the cell of a coordinate.
fn number(coordinate: f64, cell: f64) -> i64 {
    (coordinate / cell).floor() as i64
}

struct Search<'a> {
    points: &'a [[f64; 3]],
    /// Vertices in the order of their cells.
    filed: Vec<([i64; 3], u32)>,
    /// Edge of a cell (m).
    cell: f64,
    /// Cells and vertices that may still be looked at.
    left: usize,
    /// Vertices on edges, each with the first edge on which it was found.
    found: BTreeMap<u32, [u32; 2]>,
}

impl Search<'_> {
    /// Compares an edge with the vertices of the cells that it runs through; none: no more may be looked at.
    fn along(&mut self, edge: &OpenEdge) -> Option<()> {
        interrupt::point();
        let [a, b] = edge.ends.map(|i| self.points[i as usize]);
        let along = minus(b, a);
        let reach = NEAR * length(along);
        let axis = (1..3).fold(0, |most, c| if along[c].abs() > along[most].abs() { c } else { most });
        if along[axis] == 0.0 {
            return Some(());
        }

        let (cell, others) = (self.cell, [(axis + 1) % 3, (axis + 2) % 3]);
        let cells =
            |from: f64, to: f64| number(from.min(to) - reach, cell)..=number(from.max(to) + reach, cell);
        for slab in cells(a[axis], b[axis]) {
            // The part of the edge over this slab of cells, across its longest axis.
            let part = [slab as f64 * cell - reach, (slab as f64 + 1.0) * cell + reach]
                .map(|x| ((x - a[axis]) / along[axis]).clamp(0.0, 1.0));
            let [rows, columns] = others.map(|c| {
                let [from, to] = part.map(|share| a[c] + share * along[c]);
                cells(from, to)
            });
            for (row, column) in rows.flat_map(|row| columns.clone().map(move |column| (row, column))) {
                let mut at = [slab; 3];
                (at[others[0]], at[others[1]]) = (row, column);
                self.compare(edge, at)?;
            }
        }
        Some(())
    }

    /// Compares an edge with the vertices of a cell.
    fn compare(&mut self, edge: &OpenEdge, cell: [i64; 3]) -> Option<()> {
        self.left = self.left.checked_sub(1)?;
        let start = self.filed.partition_point(|(other, _)| *other < cell);
        for &(_, vertex) in self.filed[start..].iter().take_while(|(other, _)| *other == cell) {
            self.left = self.left.checked_sub(1)?;
            let is_corner = edge.ends.contains(&vertex) || edge.opposite == vertex;
            if !is_corner && lies_on(self.points[vertex as usize], edge.ends.map(|i| self.points[i as usize]))
            {
                self.found.entry(vertex).or_insert(edge.ends);
            }
        }
        Some(())
    }
}

/// Whether a point lies on a segment, away from its ends.
fn lies_on(point: [f64; 3], [a, b]: [[f64; 3]; 2]) -> bool {
    let (along, from) = (minus(b, a), minus(point, a));
    let share = dot(from, along) / dot(along, along);
    let across = minus(from, along.map(|c| share * c));
    (NEAR..=1.0 - NEAR).contains(&share) && length(across) <= NEAR * length(along)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number of -1 to 1.
    fn numbers(mut state: u32) -> impl FnMut() -> f64 {
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1_u32 << 23) - 1.0
        }
    }

    #[test]
    fn cells_find_what_comparing_every_edge_with_every_vertex_finds() {
        let mut next = numbers(3);
        for size in [1.0, 1e3, 1e-4] {
            // Edges of very different lengths; of every one two points lie between the ends, and one nearly.
            let (mut points, mut edges) = (Vec::new(), Vec::new());
            for i in 0..60_u32 {
                let length = if i % 7 == 0 { 20.0 * size } else { size };
                let a = [0; 3].map(|_| next() * 10.0 * size);
                let b = a.map(|c| c + next() * length);
                let between = |share: f64| [0, 1, 2].map(|c| a[c] + share * (b[c] - a[c]));
                let aside = between(0.6).map(|c| c + 1e-3 * length);
                points.extend([a, b, between(0.3), between(0.9999), aside, between(1.0)]);
                let [a, b, inner, last, aside, end] = [0, 1, 2, 3, 4, 5].map(|k| 6 * i + k);
                edges.push(OpenEdge { ends: [a, b], opposite: inner });
                edges.push(OpenEdge { ends: [inner, last], opposite: a });
                edges.push(OpenEdge { ends: [aside, end], opposite: a });
            }

            let mut expected = BTreeMap::new();
            for edge in &edges {
                for vertex in 0..points.len() as u32 {
                    let is_corner = edge.ends.contains(&vertex) || edge.opposite == vertex;
                    let ends = edge.ends.map(|i| points[i as usize]);
                    if !is_corner && lies_on(points[vertex as usize], ends) {
                        expected.entry(vertex).or_insert(edge.ends);
                    }
                }
            }
            let found = t_junctions(&points, &edges);
            assert!(expected.len() >= 60, "{}", expected.len());
            assert_eq!((found.count, found.is_cut_off), (expected.len(), false));
            assert_eq!(found.first, expected.first_key_value().map(|(vertex, edge)| (*vertex, *edge)));
        }
    }

    #[test]
    fn nothing_comes_of_no_edges_and_of_edges_without_length() {
        assert_eq!(t_junctions(&[], &[]), TJunctions::default());
        let edge = OpenEdge { ends: [0, 1], opposite: 2 };
        assert_eq!(t_junctions(&[[1.0; 3]; 3], &[edge]), TJunctions::default());
        let far = [[1e300; 3], [1e300, 1e300, 0.0], [0.0; 3]];
        assert!(t_junctions(&far, &[edge]).is_cut_off);
    }

    #[test]
    fn a_search_that_takes_too_long_is_cut_off_and_says_so() {
        // All vertices are in one cell, and every edge is compared with all of them.
        let points: Vec<[f64; 3]> = (0..4000).map(|i| [0.0, f64::from(i % 2), f64::from(i) * 1e-9]).collect();
        let edges: Vec<OpenEdge> =
            (0..2000).map(|i| OpenEdge { ends: [2 * i, 2 * i + 1], opposite: 2 * i }).collect();
        assert!(t_junctions(&points, &edges).is_cut_off);
    }
}
