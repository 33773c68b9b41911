//! What repeats in a mesh, found in little memory: edges of more than two triangles, triangles of the same points.
//!
//! Reads triangles; gives counts and the first. Corners are looked at in ranges of their smallest point, so that one
//! range at a time is sorted: a few bytes per point and a sixteenth of the triangles, whatever their order.

use std::ops::Range;

use super::corners::{corner_edges, is_degenerate};
use crate::interrupt;

/// Entries of a range at least.
const LEAST_ENTRIES: usize = 1 << 16;
/// Ranges that a mesh is divided into, but for points of very many triangles, which are ranges of their own.
const RANGES: usize = 16;

/// Edges of more than two triangles: how many, and the first.
pub(super) fn crowded_edges(triangles: &[[u32; 3]], points: usize) -> Option<(usize, [u32; 2])> {
    let edges = || triangles.iter().filter(|t| !is_degenerate(t)).flat_map(corner_edges);
    let (mut count, mut first) = (0, None);
    let mut note = |edge: [u32; 2]| {
        count += 1;
        first = first.or(Some(edge));
    };

    for (range, entries) in ranges(edges().map(|[a, _]| a), points) {
        interrupt::point();
        let own = edges().filter(|[a, _]| range.contains(a));
        if range.len() == 1 {
            // A fan: one count for each other point.
            let mut counts = vec![0_u8; points];
            own.for_each(|[_, b]| counts[b as usize] = counts[b as usize].saturating_add(1));
            let crowded = (0u32..).zip(&counts).filter(|(_, count)| **count > 2);
            crowded.for_each(|(b, _)| note([range.start, b]));
        } else {
            let mut sorted = Vec::with_capacity(entries);
            sorted.extend(own);
            sorted.sort_unstable();
            sorted.chunk_by(|a, b| a == b).filter(|same| same.len() > 2).for_each(|same| note(same[0]));
        }
    }
    first.map(|first| (count, first))
}

/// Triangles whose points an earlier one has: how many, and the first.
pub(super) fn repeated_triangles(triangles: &[[u32; 3]], points: usize) -> Option<(usize, usize)> {
    let corners = |t: &[u32; 3]| {
        let mut corners = *t;
        corners.sort_unstable();
        corners
    };
    let least = |t: &[u32; 3]| corners(t)[0];

    let (mut count, mut first) = (0, usize::MAX);
    for (range, entries) in ranges(triangles.iter().map(least), points) {
        interrupt::point();
        // Places take a third of the memory of triangles.
        let own = (0u32..).zip(triangles).filter(|(_, t)| range.contains(&least(t)));
        let mut places = Vec::with_capacity(entries);
        places.extend(own.map(|(place, _)| place));
        let key = |place: u32| (corners(&triangles[place as usize]), place);
        places.sort_unstable_by_key(|place| key(*place));
        for pair in places.windows(2).filter(|pair| key(pair[0]).0 == key(pair[1]).0) {
            count += 1;
            first = first.min(pair[1] as usize);
        }
    }
    (count > 0).then_some((count, first))
}

/// Ranges of points that have about as many entries each, and how many; a point of many is a range by itself.
fn ranges(entries: impl Iterator<Item = u32>, points: usize) -> Vec<(Range<u32>, usize)> {
    let mut counts = vec![0_u32; points];
    entries.for_each(|point| counts[point as usize] += 1);
    let total: usize = counts.iter().map(|count| *count as usize).sum();
    let most = (total / RANGES).max(LEAST_ENTRIES);

    let (mut ranges, mut start, mut sum) = (Vec::new(), 0, 0);
    for (point, count) in (0u32..).zip(counts) {
        if sum + count as usize > most && point > start {
            ranges.push((start..point, sum));
            (start, sum) = (point, 0);
        }
        sum += count as usize;
    }
    ranges.push((start..points as u32, sum));
    ranges
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use super::*;

    /// Triangles of few points, so that much repeats; without order.
    fn triangles(count: u32, points: u32) -> Vec<[u32; 3]> {
        let mut state = 12_345_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) % points
        };
        (0..count).map(|_| [next(), next(), next()]).collect()
    }

    fn check(triangles: &[[u32; 3]], points: usize) {
        let mut edges: BTreeMap<[u32; 2], usize> = BTreeMap::new();
        let sound = triangles.iter().filter(|t| !is_degenerate(t));
        sound.flat_map(corner_edges).for_each(|edge| *edges.entry(edge).or_default() += 1);
        edges.retain(|_, count| *count > 2);
        let first = edges.keys().next().map(|first| (edges.len(), *first));
        assert_eq!(crowded_edges(triangles, points), first);

        let mut seen = BTreeSet::new();
        let again = (0..triangles.len()).filter(|i| {
            let mut corners = triangles[*i];
            corners.sort_unstable();
            !seen.insert(corners)
        });
        let again: Vec<usize> = again.collect();
        assert_eq!(repeated_triangles(triangles, points), again.first().map(|first| (again.len(), *first)));
    }

    #[test]
    fn ranges_find_what_maps_find() {
        check(&triangles(50, 10), 10);
        check(&triangles(100_000, 300), 300);
        check(&[], 5);
        // A fan: one point has all triangles.
        let fan: Vec<[u32; 3]> =
            (1..100_000).map(|i| [i, i + 1, 0]).chain([[0, 1, 2], [2, 0, 9], [0, 7, 8]]).collect();
        check(&fan, 100_001);
    }

    #[test]
    fn a_point_of_many_entries_is_a_range_of_its_own() {
        let entries = [3_u32].into_iter().cycle().take(LEAST_ENTRIES + 1).chain(0..10);
        assert_eq!(ranges(entries, 10), [(0..3, 3), (3..4, LEAST_ENTRIES + 2), (4..10, 6)]);
        assert_eq!(ranges(0..10, 10), [(0..10, 10)]);
    }
}
