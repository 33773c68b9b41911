//! Holes of a mesh: loops of open edges, each filled by a fan of triangles from its first point.
//!
//! Reads triangles whose corners are the first of the points at each place; adds those that fill the holes. A fan is
//! flat where the hole is, and may fold over where a hole is bent: it is meant for small ones.

use std::collections::BTreeMap;

use nappe_sim::interrupt;

use super::{
    closed::{NotClosed, Numbered, check_sides, sides},
    loaded::fan,
};

/// Edges of a hole that is filled, at most.
pub(crate) const MOST_EDGES: usize = 64;

/// What becomes of holes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Holes {
    /// A mesh that has one is refused.
    Refused,
    /// Those of at most [`MOST_EDGES`] edges are filled.
    Filled,
}

/// Fills all holes; gives how many there were. The new triangles are numbered from `next` on.
pub(super) fn fill_holes(
    triangles: &mut Vec<Numbered>,
    next: u32,
    points: &[[f64; 3]],
) -> Result<usize, NotClosed> {
    let sides = sides(triangles);
    // An edge of more triangles has none that is missing.
    check_sides(&sides, triangles, points, |count| count <= 2)?;
    let open = sides.chunk_by(|a, b| a.0 == b.0).filter(|edge| edge.len() == 1).map(|edge| {
        let ([low, high], ascends, _) = edge[0];
        // What fills the hole runs along the edge against its triangle.
        if ascends { [high, low] } else { [low, high] }
    });
    let loops = loops(open.collect());
    if let Some(long) = loops.iter().find(|points| points.len() > MOST_EDGES) {
        return Err(NotClosed::LongHole {
            edges: long.len(),
            allowed: MOST_EDGES,
            point: long[0],
            position: points[long[0] as usize],
        });
    }
    let fans = loops.iter().flat_map(|points| fan(points));
    triangles.extend((next..).zip(fans));
    Ok(loops.len())
}

/// Loops of directed edges, each from its smallest point on, which no loop meets twice. Each point has as many edges
/// that begin there as edges that end there.
fn loops(mut edges: Vec<[u32; 2]>) -> Vec<Vec<u32>> {
    edges.sort_unstable();
    // Of each point, at the first of its edges, how many of them are taken.
    let mut taken = vec![0_usize; edges.len()];
    let mut loops = Vec::new();
    for start in 0..edges.len() {
        // Where each point of the way stands in it.
        let (mut way, mut places) = (Vec::<u32>::new(), BTreeMap::<u32, usize>::new());
        let mut at = edges[start][0];
        loop {
            interrupt::point();
            if let Some(&place) = places.get(&at) {
                let mut points: Vec<u32> = way.drain(place..).collect();
                for point in &points {
                    places.remove(point);
                }
                let least = (0..points.len()).min_by_key(|i| points[*i]).unwrap_or_default();
                points.rotate_left(least);
                loops.push(points);
            }
            let first = edges.partition_point(|[from, _]| *from < at);
            let Some(own) = taken.get_mut(first) else { break };
            let next = first + *own;
            if edges.get(next).is_none_or(|[from, _]| *from != at) {
                break;
            }
            *own += 1;
            places.insert(at, way.len());
            way.push(at);
            at = edges[next][1];
        }
    }
    loops.sort_unstable();
    loops
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_are_taken_apart_into_loops_that_meet_no_point_twice() {
        // A triangle, and two loops that share point 5.
        let edges = vec![[3, 9], [9, 1], [1, 3], [5, 7], [7, 6], [6, 5], [5, 2], [2, 8], [8, 4], [4, 5]];
        assert_eq!(loops(edges), [vec![1, 3, 9], vec![2, 8, 4, 5], vec![5, 7, 6]]);
        assert!(loops(Vec::new()).is_empty());
        let ring: Vec<[u32; 2]> = (0..1000).map(|i| [i, (i + 1) % 1000]).collect();
        assert_eq!(loops(ring), [(0..1000).collect::<Vec<u32>>()]);
    }
}
