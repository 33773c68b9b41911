//! What repeats in a mesh, found in little memory: edges of more than two triangles, triangles of the same points.
//!
//! Reads triangles; gives counts and the first, or leaves those out that repeat others. Corners are looked at in ranges of their smallest point, so that one
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

/// Triangles whose points an earlier one has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Repeats {
    pub(super) count: usize,
    /// The first of them.
    pub(super) first: usize,
    /// Those that run the other way round than the earlier one.
    pub(super) turned: usize,
}

/// Triangles whose points an earlier one has, if there are any.
pub(super) fn repeated_triangles(triangles: &[[u32; 3]], points: usize) -> Option<Repeats> {
    let mut found = Repeats { count: 0, first: usize::MAX, turned: 0 };
    for_each_repeat(triangles, points, |place, is_turned| {
        found.count += 1;
        found.first = found.first.min(place as usize);
        found.turned += usize::from(is_turned);
    });
    (found.count > 0).then_some(found)
}

/// Leaves out the triangles whose points an earlier one has; the others keep their order.
pub(super) fn drop_repeats(triangles: &mut Vec<[u32; 3]>, points: usize) {
    let mut repeats = Vec::new();
    for_each_repeat(triangles, points, |place, _| repeats.push(place));
    repeats.sort_unstable();
    let mut repeats = repeats.into_iter().peekable();
    let mut places = 0u32..;
    triangles.retain(|_| {
        let place = places.next();
        repeats.next_if(|repeat| Some(*repeat) == place).is_none()
    });
}

/// Calls `note` for each triangle whose points an earlier one has, with its place and whether it runs the other way
/// round than the first of them; not in the order of the triangles.
fn for_each_repeat(triangles: &[[u32; 3]], points: usize, mut note: impl FnMut(u32, bool)) {
    let corners = |t: &[u32; 3]| {
        let mut corners = *t;
        corners.sort_unstable();
        corners
    };
    let least = |t: &[u32; 3]| corners(t)[0];

    for (range, entries) in ranges(triangles.iter().map(least), points) {
        interrupt::point();
        // Places take a third of the memory of triangles.
        let own = (0u32..).zip(triangles).filter(|(_, t)| range.contains(&least(t)));
        let mut places = Vec::with_capacity(entries);
        places.extend(own.map(|(place, _)| place));
        let key = |place: u32| (corners(&triangles[place as usize]), place);
        places.sort_unstable_by_key(|place| key(*place));
        for same in places.chunk_by(|a, b| key(*a).0 == key(*b).0) {
            let first = is_ascending(&triangles[same[0] as usize]);
            for &place in &same[1..] {
                note(place, is_ascending(&triangles[place as usize]) != first);
            }
        }
    }
}

/// Whether the corners of a triangle ascend when the smallest is put first: two triangles of the same points run the
/// same way round if that holds for both or for neither. One that names a point twice has no way round.
fn is_ascending([a, b, c]: &[u32; 3]) -> bool {
    // Of three numbers that differ, two go up around the ring, or one.
    [a < b, b < c, c < a].into_iter().filter(|goes_up| *goes_up).count() == 2
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
        let found = repeated_triangles(triangles, points);
        assert_eq!(
            found.map(|found| (found.count, found.first)),
            again.first().map(|first| (again.len(), *first))
        );

        let mut dropped = triangles.to_vec();
        drop_repeats(&mut dropped, points);
        let kept = triangles.iter().enumerate().filter(|(place, _)| again.binary_search(place).is_err());
        assert_eq!(dropped, kept.map(|(_, t)| *t).collect::<Vec<_>>());
    }

    #[test]
    fn repeats_that_run_the_other_way_round_are_counted() {
        let sheet = [[0, 1, 2], [2, 1, 3], [1, 2, 0], [2, 1, 0], [3, 1, 2], [3, 2, 1], [5, 5, 4], [4, 5, 5]];
        let expected = Repeats { count: 5, first: 2, turned: 2 };
        assert_eq!(repeated_triangles(&sheet, 6), Some(expected));
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
