//! Edges far shorter than the others, and points that nearly coincide: the stretch of such an edge means little, and it
//! makes explicit steps tiny; such points were often meant to be one.

use super::corners::corner_edges;
use crate::{interrupt, math::array};

/// Share of the median edge below which an edge is short and points nearly coincide.
const SHARE: f64 = 1.0 / 50.0;
/// Triangles whose edges give the median, at most: evenly spaced ones.
const SAMPLE: usize = 4096;
/// Short edges that are counted, and points that are compared per grid of cells, at most: a mesh of nothing else takes
/// little memory to look at.
pub(super) const CANDIDATES: usize = 1 << 16;
/// Points of its cell that a point is compared with, at most.
const COMPARED: usize = 8;

/// What lies too close.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Close {
    /// Edges, or points.
    pub(super) count: usize,
    /// The two points that are closest.
    pub(super) points: [u32; 2],
    /// Their distance (m).
    pub(super) distance: f64,
    /// The median edge (m).
    pub(super) median: f64,
}

/// Short edges, and points that nearly coincide although no edge joins them. Where more than [`CANDIDATES`] edges are
/// short, so many are counted, and such points are not looked for.
pub(super) fn close(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> [Option<Close>; 2] {
    let Some(median) = median_edge(points, triangles) else { return [None, None] };
    let below = |edge: &[u32; 2]| length(points, *edge) < SHARE * median;
    let edges = || triangles.iter().inspect(|_| interrupt::point()).flat_map(corner_edges).filter(below);
    let mut short: Vec<_> = edges().take(CANDIDATES).collect();
    let is_all = short.len() < CANDIDATES;
    short.sort_unstable();
    short.dedup();

    let count = short.len();
    let shortest = edges().map(|edge| (edge, length(points, edge))).min_by(|a, b| a.1.total_cmp(&b.1));
    let edges = shortest.map(|(points, distance)| Close { count, points, distance, median });
    [edges, is_all.then(|| near_points(points, median, &short)).flatten()]
}

fn length(points: &[[f64; 3]], [a, b]: [u32; 2]) -> f64 {
    array::length(array::minus(points[a as usize], points[b as usize]))
}

/// The median length of the edges of a sample of triangles; none without edges, or if it is 0.
pub(super) fn median_edge(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Option<f64> {
    let sample = triangles.iter().step_by(triangles.len().div_ceil(SAMPLE).max(1));
    let mut lengths: Vec<f64> = sample.flat_map(corner_edges).map(|edge| length(points, edge)).collect();
    let middle = lengths.len() / 2;
    (!lengths.is_empty())
        .then(|| *lengths.select_nth_unstable_by(middle, f64::total_cmp).1)
        .filter(|median| *median > 0.0 && median.is_finite())
}

/// Points within `SHARE` of the median edge of another that no short edge joins to it.
///
/// Two such points share a cell of twice that size in one of eight grids, shifted by half a cell along each axis or not.
/// Only points whose cell seems to have another are compared: bits per cell tell.
fn near_points(points: &[[f64; 3]], median: f64, short: &[[u32; 2]]) -> Option<Close> {
    let reach = SHARE * median;
    let mut is_near = Bits::new(points.len());
    let mut closest: Option<([u32; 2], f64)> = None;
    for shift in 0..8_u32 {
        let key = |point: &[f64; 3]| {
            interrupt::point();
            let cell = [0, 1, 2].map(|c| {
                let half = f64::from(shift >> c & 1);
                (0.5 * (point[c] / reach + half)).floor() as i64 as u64
            });
            mixed(mixed(mixed(cell[0]) ^ cell[1]) ^ cell[2])
        };
        for pair in sharing(points, key) {
            let distance = length(points, pair);
            if distance < reach && short.binary_search(&pair).is_err() {
                is_near.set(pair[0] as usize);
                is_near.set(pair[1] as usize);
                if closest.is_none_or(|(_, least)| distance < least) {
                    closest = Some((pair, distance));
                }
            }
        }
    }
    let (points, distance) = closest?;
    Some(Close { count: is_near.count(), points, distance, median })
}

/// Pairs of points whose keys are equal, the smaller first: of each point with the next few of its key.
fn sharing(points: &[[f64; 3]], key: impl Fn(&[f64; 3]) -> u64) -> Vec<[u32; 2]> {
    let cells = (8 * points.len()).next_power_of_two();
    // Two places per key: a point whose cell has no other seems to share both only rarely.
    let places = |key: u64| [key, key >> 32].map(|bits| bits as usize & (cells - 1));
    let [mut once, mut twice] = [(); 2].map(|()| [Bits::new(cells), Bits::new(cells)]);
    for point in points {
        for (which, place) in places(key(point)).into_iter().enumerate() {
            if once[which].get(place) {
                twice[which].set(place);
            }
            once[which].set(place);
        }
    }

    let keys = (0..).zip(points).map(|(index, point)| (key(point), index));
    let is_shared = |(key, _): &(u64, u32)| {
        let [first, second] = places(*key);
        twice[0].get(first) && twice[1].get(second)
    };
    let mut shared: Vec<_> = keys.filter(is_shared).take(CANDIDATES).collect();
    shared.sort_unstable();

    let mut pairs = Vec::new();
    for (i, (key, first)) in shared.iter().enumerate() {
        let others = shared[i + 1..].iter().take(COMPARED).take_while(|(other, _)| other == key);
        pairs.extend(others.map(|(_, second)| [*first, *second]));
    }
    pairs
}

/// Spreads a number over all bits (the finaliser of SplitMix64; Steele et al. 2014).
fn mixed(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

/// A bit each.
struct Bits(Vec<u64>);

impl Bits {
    fn new(count: usize) -> Self {
        Self(vec![0; count.div_ceil(64)])
    }

    fn get(&self, index: usize) -> bool {
        self.0[index / 64] >> (index % 64) & 1 == 1
    }

    fn set(&mut self, index: usize) {
        self.0[index / 64] |= 1 << (index % 64);
    }

    fn count(&self) -> usize {
        self.0.iter().map(|word| word.count_ones() as usize).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a flat lattice and two triangles per cell.
    fn lattice(columns: u32, rows: u32, spacing: f64) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
        let point = |i: u32| [f64::from(i % columns) * spacing, 0.0, f64::from(i / columns) * spacing];
        let corners = (0..rows - 1).flat_map(|r| (0..columns - 1).map(move |c| r * columns + c));
        let cell = |a: u32| [[a, a + 1, a + columns], [a + 1, a + columns + 1, a + columns]];
        ((0..columns * rows).map(point).collect(), corners.flat_map(cell).collect())
    }

    #[test]
    fn a_lattice_has_nothing_close() {
        let (points, triangles) = lattice(40, 30, 0.02);
        assert_eq!(close(&points, &triangles), [None, None]);
        assert_eq!(close(&[[0.0; 3]; 5], &[]), [None, None]);
    }

    #[test]
    fn short_edges_are_found_with_the_shortest() {
        let (mut points, triangles) = lattice(12, 12, 0.1);
        points[15] = [points[16][0] - 1e-3, 0.0, points[16][2]];
        points[40] = [points[41][0] - 2e-4, 0.0, points[41][2]];
        let [short, near] = close(&points, &triangles);
        let short = short.expect("two edges are short");
        assert_eq!((short.count, short.points), (2, [40, 41]));
        assert!((short.distance - 2e-4).abs() < 1e-15 && (0.1..0.15).contains(&short.median), "{short:?}");
        assert_eq!(near, None, "an edge joins them");
    }

    /// Two sheets side by side that were to be one: every point of the seam is there twice, as exporters leave them.
    #[test]
    fn points_of_a_seam_that_nearly_coincide_are_found_wherever_they_lie() {
        for (place, apart) in [(0.0, 0.0), (0.0123, 1e-4), (-7.77, 1.9e-3)] {
            let (mut points, mut triangles) = lattice(10, 20, 0.1);
            let count = points.len() as u32;
            for x in &mut points {
                x[1] += place;
            }
            let other: Vec<_> = points.iter().map(|x| [x[0] + 0.9 + apart, x[1], x[2]]).collect();
            points.extend(other);
            let others: Vec<_> = triangles.iter().map(|t| t.map(|point| point + count)).collect();
            triangles.extend(others);

            let [short, near] = close(&points, &triangles);
            assert_eq!(short, None);
            let near = near.expect("the seam");
            assert_eq!(near.count, 40, "{near:?}");
            assert!((near.distance - apart).abs() < 1e-12, "{near:?}");
            assert_eq!(near.points[1] - near.points[0], count - 9, "{near:?}");
        }
    }
}
