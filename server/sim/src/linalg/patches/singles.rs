//! Sixteen numbers of binary32 side by side: what fronts and functions are stored in.

use bytemuck::{Pod, Zeroable};

use crate::math::LANES;

/// Sixteen numbers in a line of the cache.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Singles(pub(super) [f32; LANES]);

impl Singles {
    pub(super) const ZERO: Self = Self([0.0; LANES]);
}

/// The numbers one after another.
#[inline(always)]
pub(super) fn flat(singles: &[Singles]) -> &[f32] {
    bytemuck::cast_slice(singles)
}

/// The same, to be written.
#[inline(always)]
pub(super) fn flat_mut(singles: &mut [Singles]) -> &mut [f32] {
    bytemuck::cast_slice_mut(singles)
}

/// Empties a list and gives it memory for so many elements, or for a quarter more where it has less.
pub(super) fn room<T>(list: &mut Vec<T>, len: usize) {
    list.clear();
    if list.capacity() < len {
        list.reserve_exact(len + len / 4);
    }
}

/// Makes a list so long, in the memory that it has where that suffices, or in a quarter more than it needs. What it holds
/// then means nothing.
pub(super) fn fit(list: &mut Vec<Singles>, len: usize) {
    if list.capacity() < len {
        // What it had is given back first.
        *list = Vec::new();
        list.reserve_exact(len + len / 4);
    }
    list.resize(len, Singles::ZERO);
}
