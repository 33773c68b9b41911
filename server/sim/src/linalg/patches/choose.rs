//! Which particles make a patch: one and its ring, within its block.

use super::graph::Graph;
use crate::interrupt;

/// Particles of a patch, at most: one and eight around it, as on a grid.
pub(super) const MOST: usize = 9;

/// The patches of all blocks, by their particles, the first of which is the one in the middle; those of a block one after
/// another. Particles that nothing may change are in none.
///
/// Of the particles left that with the largest ring left is taken with it, of equal ones that whose ring has the most
/// neighbours taken or missing, which packs patches side by side; then the one of smallest number.
pub(super) fn choose(rings: &Graph, is_free: &[bool], block_size: usize) -> Vec<Vec<Vec<u32>>> {
    let mut is_left = is_free.to_vec();
    let left_of = |i: u32, is_left: &[bool]| rings.of(i).iter().filter(|j| is_left[**j as usize]).count();
    let mut ring_left: Vec<u32> = (0..rings.len() as u32).map(|i| left_of(i, &is_left) as u32).collect();
    let count = rings.len();
    (0..count.div_ceil(block_size))
        .map(|block| {
            let rows = (block * block_size) as u32..((block + 1) * block_size).min(count) as u32;
            let mut left: Vec<u32> = rows.filter(|i| is_left[*i as usize]).collect();
            let mut patches = Vec::new();
            while let Some(middle) = next(&left, rings, &is_left, &ring_left) {
                interrupt::point();
                let around = rings.of(middle).iter().filter(|j| is_left[**j as usize]).take(MOST - 1);
                let patch: Vec<u32> = [middle].into_iter().chain(around.copied()).collect();
                for i in &patch {
                    is_left[*i as usize] = false;
                    rings.of(*i).iter().for_each(|j| ring_left[*j as usize] -= 1);
                }
                left.retain(|i| is_left[*i as usize]);
                patches.push(patch);
            }
            patches
        })
        .collect()
}

/// The particle in the middle of the next patch; none where none is left.
fn next(left: &[u32], rings: &Graph, is_left: &[bool], ring_left: &[u32]) -> Option<u32> {
    let size = |i: u32| (ring_left[i as usize] as usize + 1).min(MOST);
    let largest = left.iter().map(|i| size(*i)).max()?;
    let touched = |i: u32| -> i64 {
        let around = rings.of(i).iter().filter(|j| is_left[**j as usize]);
        around.map(|j| MOST as i64 - 1 - i64::from(ring_left[*j as usize])).sum()
    };
    let mut best: Option<(i64, u32)> = None;
    for &i in left.iter().filter(|i| size(**i) == largest) {
        let touched = touched(i);
        if best.is_none_or(|(most, _)| touched > most) {
            best = Some((touched, i));
        }
    }
    best.map(|(_, i)| i)
}

#[cfg(test)]
mod tests {
    use super::{MOST, choose};
    use crate::linalg::patches::graph::Graph;

    /// A square of so many rows a side, row by row, with its diagonals; only within blocks.
    fn grid(side: u32, block_size: u32) -> Graph {
        let ends = |i: u32| {
            let (x, y) = (i % side, i / side);
            let near = [(x + 1, y), (x, y + 1), (x + 1, y + 1), (x.wrapping_sub(1), y + 1)];
            near.into_iter().filter(|(x, y)| *x < side && *y < side).map(move |(x, y)| [i, y * side + x])
        };
        let pairs = (0..side * side).flat_map(ends);
        let within = pairs.filter(move |[i, j]| i / block_size == j / block_size);
        Graph::new((side * side) as usize, within)
    }

    #[test]
    fn a_square_is_packed_with_squares_of_nine() {
        let patches = choose(&grid(9, 81), &[true; 81], 81);
        assert_eq!(patches.len(), 1);
        assert_eq!(patches[0].iter().map(Vec::len).collect::<Vec<_>>(), [9; 9]);
    }

    #[test]
    fn everyone_who_is_free_is_in_one_patch_of_his_block() {
        let mut is_free = [true; 256];
        for i in [0, 1, 2, 3, 16, 17, 77] {
            is_free[i] = false;
        }
        (224..256).for_each(|i| is_free[i as usize] = false);
        let patches = choose(&grid(16, 32), &is_free, 32);
        let mut seen = [0; 256];
        for (block, patches) in patches.iter().enumerate() {
            for patch in patches {
                assert!(!patch.is_empty() && patch.len() <= MOST);
                assert!(patch.iter().all(|i| *i as usize / 32 == block));
                for i in patch {
                    seen[*i as usize] += 1;
                }
            }
        }
        assert!((0..256).all(|i| seen[i] == i32::from(is_free[i])), "{seen:?}");
        assert!(patches[7].is_empty(), "all of it pinned");
    }

    #[test]
    fn what_nothing_joins_and_what_everything_joins_are_patches_too() {
        let alone = Graph::new(5, std::iter::empty());
        assert_eq!(choose(&alone, &[true; 5], 32), [[[0], [1], [2], [3], [4]]]);
        let star = Graph::new(20, (1..20).map(|i| [0, i]));
        let patches = choose(&star, &[true; 20], 32);
        assert_eq!(patches[0][0], (0..9).collect::<Vec<u32>>());
        assert_eq!(patches[0].len(), 12);
        assert_eq!(choose(&Graph::new(0, std::iter::empty()), &[], 32), Vec::<Vec<Vec<u32>>>::new());
    }
}
