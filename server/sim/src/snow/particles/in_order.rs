//! What particles carry, written in the user's numbering by all threads.
#![allow(unsafe_code, reason = "the borrow checker does not see that no two particles have one number")]

use super::Particles;
use crate::{
    math::Real,
    parallel::{Disjoint, Own, per_row},
};

/// Particles that a thread takes at a time.
const BLOCK_SIZE: usize = 4096;

impl<R: Real> Particles<R> {
    /// Writes `of` of each particle, `N` numbers, over those of its number in `out`.
    ///
    /// # Panics
    /// Unless `out` has `N` numbers per particle.
    pub(crate) fn write_in_order<T: Send, const N: usize>(
        &self,
        out: &mut [T],
        of: impl Fn(usize) -> [T; N] + Sync,
    ) {
        assert_eq!(out.len(), N * self.len(), "{N} numbers per particle");
        let out = Disjoint::new(out.as_chunks_mut::<N>().0);
        Own::whole(self.len(), BLOCK_SIZE).each(per_row(&self.id), |block, ids| {
            for (i, id) in ids.iter().enumerate() {
                // SAFETY: particles are numbered once, and sorting only permutes them: each number is there once.
                let place = unsafe { out.slot(*id as usize) };
                *place = of(block * BLOCK_SIZE + i);
            }
        });
    }
}
