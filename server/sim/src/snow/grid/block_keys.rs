//! Sorted lists of keys of blocks: looking keys up, and uniting lists.
//!
//! Keys sort as coordinates do, so the blocks a fixed step away from the blocks of a list come in
//! the order of the list: both are done by walking along, without sorting or searching.

use super::blocks::{Coordinate, NONE, block_of, key_of, shifted};
use crate::parallel::{Own, per_row, per_row_mut};

/// What to add to the key of a block for the key of the block a step away, without periods.
pub(crate) fn step_of(by: Coordinate) -> u64 {
    by.iter().fold(0_u64, |key, c| (key << 21).wrapping_add_signed(i64::from(*c)))
}

/// Finds keys in a sorted list, fast where each is the same as the one before or a little further.
#[derive(Clone, Copy)]
pub(crate) struct Finder<'a> {
    keys: &'a [u64],
    /// The first key that is not before the last one asked for.
    at: usize,
}

/// Keys that are looked at one by one before the rest of the list is searched.
const NEAR: usize = 8;

impl<'a> Finder<'a> {
    /// From the start of a list.
    pub(crate) fn new(keys: &'a [u64]) -> Self {
        Self { keys, at: 0 }
    }

    /// Index of a key in the list, or [`NONE`].
    #[inline]
    pub(crate) fn find(&mut self, key: u64) -> u32 {
        let keys = self.keys;
        if self.at > 0 && keys[self.at - 1] >= key {
            self.at = keys[..self.at].partition_point(|other| *other < key);
        } else {
            let near = keys[self.at..].iter().take(NEAR).take_while(|other| **other < key).count();
            self.at += near;
            if near == NEAR {
                self.at += keys[self.at..].partition_point(|other| *other < key);
            }
        }

        if keys.get(self.at) == Some(&key) { self.at as u32 } else { NONE }
    }
}

/// All keys of two sorted sequences, sorted, each once.
pub(crate) fn unite(
    first: impl IntoIterator<Item = u64>,
    second: impl IntoIterator<Item = u64>,
    out: &mut Vec<u64>,
) {
    out.clear();
    let (mut first, mut second) = (first.into_iter().peekable(), second.into_iter().peekable());
    while let (Some(&a), Some(&b)) = (first.peek(), second.peek()) {
        out.push(a.min(b));
        if a <= b {
            first.next();
        }
        if b <= a {
            second.next();
        }
    }

    out.extend(first);
    out.extend(second);
}

/// Blocks that one thread looks up neighbours for at a time.
const TOGETHER: usize = 256;

/// For each block of a list, where in another list the blocks stand that are `by(i)` away.
pub(crate) fn find_neighbors<const K: usize>(
    blocks: &[u64],
    others: &[u64],
    out: &mut [[u32; K]],
    by: impl Fn(usize) -> [i32; 3] + Sync,
    periodic: [u32; 3],
) {
    let fields = (per_row_mut(out), per_row(blocks));
    Own::whole(blocks.len(), TOGETHER).each(fields, |_, (out, blocks)| {
        for i in 0..K {
            let (mut finder, by) = (Finder::new(others), by(i));
            let step = step_of(by);
            for (found, &key) in out.iter_mut().zip(blocks) {
                let wanted = match periodic {
                    [0, 0, 0] => key.wrapping_add(step),
                    _ => key_of(shifted(block_of(key), by, periodic)),
                };
                found[i] = finder.find(wanted);
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::{Finder, step_of, unite};
    use crate::snow::grid::blocks::{NONE, key_of, shifted};

    /// Every third number has a key, some many times as far as others.
    fn keys() -> Vec<u64> {
        (0..200_u64).map(|i| 3 * i + 1000 * (i / 40)).collect()
    }

    #[test]
    fn a_finder_finds_what_a_search_finds_in_any_order() {
        let keys = keys();
        let mut finder = Finder::new(&keys);
        let forward = (0..857).map(|i| 7 * i);
        for key in forward.clone().chain(forward.rev()).chain([0, 5990, 3, 3, 4000, 0]) {
            let expected = keys.binary_search(&key).map_or(NONE, |index| index as u32);
            assert_eq!(finder.find(key), expected, "key {key}");
        }
        assert_eq!(Finder::new(&[]).find(5), NONE);
    }

    #[test]
    fn a_union_is_sorted_and_has_every_key_once() {
        let (keys, mut united) = (keys(), Vec::new());
        let shifted = keys.iter().map(|key| key + 9);
        unite(keys.iter().copied(), shifted.clone(), &mut united);
        let mut expected: Vec<u64> = keys.iter().copied().chain(shifted).collect();
        expected.sort_unstable();
        expected.dedup();
        assert_eq!(united, expected);
    }

    #[test]
    fn a_step_of_keys_is_a_step_of_blocks() {
        for block in [[0, 0, 0], [-1, 5, -7], [100, -1, 0], [-3, -3, -3]] {
            for by in [[0, 0, 1], [0, 1, 0], [1, 0, 0], [-1, -1, -1], [1, -1, 1], [0, 0, -1]] {
                let moved = key_of(block).wrapping_add(step_of(by));
                assert_eq!(moved, key_of(shifted(block, by, [0; 3])), "{block:?} by {by:?}");
            }
        }
    }
}
