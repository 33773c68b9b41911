//! What is added up over an iterate, block by block: what forces and inertia leave over, and where a sweep led.

use crate::parallel::Share;

/// What forces and inertia leave over at an iterate: of a block, or of all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Leftover {
    /// |u - V|²_M / 2 (J).
    pub(crate) inertia: f64,
    /// The square of the residual, each row by its inverse mass (J).
    pub(crate) square: f64,
    /// The residual times the change of velocities that was tried, 0 without one (J).
    pub(crate) along: f64,
    /// The largest residual as an acceleration (m/s²).
    pub(crate) largest: f64,
}

impl Leftover {
    /// That of all blocks of all ranks.
    pub(crate) fn of_all(share: &Share, blocks: &[Self]) -> Self {
        let here = share.own().blocks(blocks).iter().map(|block| block.largest).fold(0.0, f64::max);
        let sums = |block: &Self| [block.inertia, block.square, block.along];
        let mut largest = 0.0;
        let [inertia, square, along] =
            share.sum_and_tell(blocks, &sums, [here], |[of_rank]| largest = f64::max(largest, of_rank));
        Self { inertia, square, along, largest }
    }
}

/// Where a sweep led from velocities `from` to `v`, the one before it having ended at `before`: of a block, or of all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SweepSums {
    /// m (from - v).(v - before) (J): above 0 where the sweep went back.
    pub(crate) uphill: f64,
    /// m |from - v|² (J): 0 where it moved nothing.
    pub(crate) way: f64,
}

impl SweepSums {
    /// Those of all blocks of all ranks.
    pub(crate) fn of_all(share: &Share, blocks: &[Self]) -> Self {
        let [uphill, way] = share.sum(blocks, &|block: &Self| [block.uphill, block.way]);
        Self { uphill, way }
    }
}
