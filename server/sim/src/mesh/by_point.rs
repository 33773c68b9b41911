//! Entries of a mesh in ascending order: filed under their point first, then sorted there.
//!
//! Work grows with the entries, but for those of one point, and can be left between two points.

use crate::interrupt;

/// Sorts entries, each a point below `points` and what is to be known of it.
pub(crate) fn sorted<T: Copy + Default + Ord>(
    entries: impl Iterator<Item = (u32, T)> + Clone,
    points: usize,
) -> Vec<(u32, T)> {
    let mut ends = vec![0_usize; points];
    let mut count = 0;
    for (point, _) in entries.clone() {
        interrupt::point();
        ends[point as usize] += 1;
        count += 1;
    }

    // Of each point the place of its first entry, which becomes that behind its last one.
    let mut start = 0;
    for end in &mut ends {
        (*end, start) = (start, start + *end);
    }

    let mut filed = vec![(0, T::default()); count];
    for (point, entry) in entries {
        interrupt::point();
        let place = &mut ends[point as usize];
        filed[*place] = (point, entry);
        *place += 1;
    }

    let mut start = 0;
    for end in ends {
        interrupt::point();
        filed[start..end].sort_unstable();
        start = end;
    }
    filed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_sorted_as_by_comparing_all() {
        let entries =
            (0..5000_u32).map(|i| (i.wrapping_mul(2_654_435_761) % 97, i.wrapping_mul(40_503) % 11));
        let mut expected: Vec<_> = entries.clone().collect();
        expected.sort_unstable();
        assert_eq!(sorted(entries, 97), expected);
        assert!(sorted(std::iter::empty::<(u32, u32)>(), 3).is_empty());
    }
}
