//! How work is divided: fixed blocks of particles, and sums over them in a fixed order.
//!
//! Blocks are cut from the scene alone, so neither the number of threads nor of cluster ranks changes a result.

mod disjoint;
mod each;
mod hash;
mod order;
mod triad;
mod zeroed;
mod communicator;
mod post;
mod spare;
mod border;
mod party;
mod share;

pub use communicator::{Communicator, Message};
pub use order::hilbert_order;
pub use share::Share;
pub use triad::triad;

pub(crate) use border::Border;
pub(crate) use communicator::Ranks;
pub(crate) use disjoint::Disjoint;
#[cfg(test)]
pub(crate) use each::on_threads;
pub(crate) use each::{
    Own, Parts, between_mut, join, per_block, per_block_mut, per_row, per_row_mut, per_sixteen,
    per_sixteen_mut, several_between_mut, several_per_block, several_per_block_mut, thread_count,
    thread_number,
};
pub(crate) use hash::{hash_numbers, sum_hashes};
pub(crate) use post::Post;
pub(crate) use spare::{Lent, Spare};
pub(crate) use zeroed::{size, zeroed};

/// Adds one partial result per block in a fixed binary tree over the blocks' numbers.
///
/// The left subtree holds the largest power of two of blocks, so that a cluster rank that owns
/// whole subtrees can add them by itself.
pub fn sum<const K: usize>(partials: &[[f64; K]]) -> [f64; K] {
    sum_by(partials, &|partial| *partial)
}

/// Adds `of` of each element in the same tree.
pub(crate) fn sum_by<T, const K: usize>(elements: &[T], of: &impl Fn(&T) -> [f64; K]) -> [f64; K] {
    match elements {
        [] => [0.0; K],
        [only] => of(only),
        _ => {
            let half = elements.len().next_power_of_two() / 2;
            let (left, right) = (sum_by(&elements[..half], of), sum_by(&elements[half..], of));
            std::array::from_fn(|k| left[k] + right[k])
        }
    }
}

/// Number of blocks of `block_size` particles that `count` particles fill.
pub const fn block_count(count: usize, block_size: usize) -> usize {
    count.div_ceil(block_size)
}

#[cfg(test)]
mod tests {
    use super::sum;

    #[test]
    fn a_sum_adds_every_partial_once() {
        for count in 0..40 {
            let partials: Vec<[f64; 2]> = (0..count).map(|i| [f64::from(i), 1.0]).collect();
            let expected = f64::from(count * (count - 1) / 2);
            assert_eq!(sum(&partials), [expected, f64::from(count)]);
        }
    }

    #[test]
    fn a_subtree_of_a_power_of_two_is_added_as_if_alone() {
        let partials: Vec<[f64; 1]> =
            (0..24).map(|i| [(0.7 + f64::from(i)).sqrt() * 1e9f64.powi(i % 3)]).collect();
        let [left, right] = [sum(&partials[..16])[0], sum(&partials[16..])[0]];
        assert_eq!(sum(&partials)[0].to_bits(), (left + right).to_bits());
    }
}
