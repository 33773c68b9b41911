//! Where particles go in a step: to which of the blocks around their own, and to which cell there.
//!
//! Reads first nodes; writes codes by position in the sorted order, for the sorter.

use super::blocks::SIDE;
use crate::{
    math::{LANES, Pack},
    parallel::Disjoint,
};

/// Directions to the blocks around a block, itself in the middle.
pub(crate) const AROUND: usize = 27;
/// The direction of those that stay.
pub(crate) const STAY: usize = 13;
/// The code of a particle that went further than to a block around its own.
pub(crate) const FAR: u16 = u16::MAX;

/// The code of a particle that went to another rank.
pub(crate) const GONE: u16 = u16::MAX - 1;

/// A step of -1, 0, 1 along each axis.
pub(crate) fn direction(i: usize) -> [i32; 3] {
    [(i / 9) as i32 - 1, (i / 3 % 3) as i32 - 1, (i % 3) as i32 - 1]
}

/// Codes of particles that come from `block` and whose first nodes are now `node`, whole numbers.
#[inline(always)]
pub(crate) fn codes<P: Pack>(block: &[P; 3], node: &[P; 3], periodic: [u32; 3]) -> [u16; LANES] {
    let (mut code, mut by) = (P::zero(), *node);
    for axis in 0..3 {
        let start = (node[axis] * P::of(1.0 / SIDE as f64)).floor();
        let cell = node[axis] - start * P::of(SIDE as f64);
        by[axis] = start - block[axis];
        if periodic[axis] > 0 {
            let period = P::of(f64::from(periodic[axis]));
            let least = by[axis] - period * (by[axis] / period).floor();
            by[axis] = period.if_less(least + least, least - period, least);
        }
        // A displacement by -1, 0 or 1 block in base 3, times 64, and the cell in base 4.
        let [direction, inner] = [[576.0, 16.0], [192.0, 4.0], [64.0, 1.0]][axis];
        code = code + (by[axis] + P::one()) * P::of(direction) + cell * P::of(inner);
    }

    // Also where a coordinate is not a number.
    let far = P::of(f64::from(FAR));
    for by in by {
        code = by.abs().if_less(P::of(1.5), code, far);
    }

    code.whole()
}

/// Where particles go, written by several threads.
pub(crate) struct Migration<'a> {
    pub(crate) codes: Disjoint<'a, u16>,
}

impl Migration<'_> {
    /// Codes of the particles from a position of the order on.
    #[inline(always)]
    #[allow(unsafe_code, reason = "chunks of blocks have ranges of their own in the order")]
    pub(crate) fn note(&self, position: usize, codes: &[u16]) {
        for (i, code) in codes.iter().enumerate() {
            // SAFETY: a position belongs to one chunk of blocks, which is worked on by one thread.
            unsafe { *self.codes.slot(position + i) = *code };
        }
    }
}
