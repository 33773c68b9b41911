//! How far a sub-step that is tried moves particles, found block by block where velocities are at hand.

use crate::{
    linalg::{add_lanes, lanes_at},
    math::{LANES, Pack, array::dot},
    parallel::Share,
    report::ErrorEstimate,
};

/// Sums over the free particles of a block, or of all. `e` is the vector of a particle that its error is proportional to: a
/// change of velocity (m/s), an acceleration (m/s²), or one divided by a time (m/s³). All but `error` and `largest` are 0 where
/// no step is judged by them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moved {
    /// |e|², in the square of the unit of e.
    error: f64,
    /// m |u - V|² (J), of an implicit step; m |a|² (J/s²), of explicit Euler.
    change: f64,
    /// |u|² (m²/s²).
    own: f64,
    /// u.wind (m²/s²).
    along: f64,
    /// The greatest |e|², in the square of the unit of e.
    largest: f64,
}

impl Moved {
    /// That of all blocks of all ranks.
    fn of_all(share: &Share, blocks: &[Self]) -> Self {
        let here = share.own().blocks(blocks).iter().map(|block| block.largest).fold(0.0, f64::max);
        let sums = |block: &Self| [block.error, block.change, block.own, block.along];
        let mut largest = 0.0;
        let [error, change, own, along] =
            share.sum_and_tell(blocks, &sums, [here], |[of_rank]| largest = f64::max(largest, of_rank));
        Self { error, change, own, along, largest }
    }
}

/// How a sub-step moves the free particles of a cloth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Motion {
    /// Estimated error of positions.
    pub(crate) error: ErrorEstimate,
    /// |u - V|² m / 2 (J), of an implicit step: of implicit Euler |v' - v|² m / 2. Of explicit Euler |a|² m / 2 (J/s²).
    pub(crate) change: f64,
    /// |u|² (m²/s²), of an implicit step: of implicit Euler u = v'.
    pub(crate) own: f64,
    /// u.wind (m²/s²), likewise.
    pub(crate) along: f64,
}

impl Motion {
    /// From the sums of all blocks: the error of a particle is `scale` times the length of what its block added up.
    pub(crate) fn of(share: &Share, blocks: &[Moved], free_count: usize, scale: f64) -> Self {
        let Moved { error, change, own, along, largest } = Moved::of_all(share, blocks);
        let rms = scale * (error / free_count.max(1) as f64).sqrt();
        let error = ErrorEstimate { rms, largest: scale * largest.sqrt() };
        Self { error, change: 0.5 * change, own, along }
    }
}

/// Masses and the medium, of an implicit step.
#[derive(Clone, Copy)]
pub(crate) struct Weights<'a, R> {
    /// Mass (kg) and its inverse, 0 for pins, of the particles of a block.
    pub(crate) m: &'a [R],
    pub(crate) inv_m: &'a [R],
    /// Velocity of the medium (m/s).
    pub(crate) wind: [f64; 3],
}

/// Sums of a block, in lanes: those of [`Moved`].
pub(crate) struct MovedSums<W> {
    error: W,
    change: W,
    own: W,
    along: W,
    largest: W,
}

impl<W: Pack<Number = f64>> MovedSums<W> {
    #[inline(always)]
    pub(crate) fn none() -> Self {
        let zero = W::zero();
        Self { error: zero, change: zero, own: zero, along: zero, largest: zero }
    }

    /// Adds what the error of sixteen particles is proportional to.
    #[inline(always)]
    pub(crate) fn add_error(&mut self, of: [W; 3]) {
        let square = dot(of, of);
        self.error += square;
        self.largest = self.largest.max(square);
    }

    /// Adds the change of sixteen velocities, and what they become.
    #[inline(always)]
    pub(crate) fn add_weighed<P: Pack<Wide = W>>(
        &mut self,
        group: usize,
        weights: &Weights<'_, P::Number>,
        [change, new]: [[W; 3]; 2],
    ) {
        let (m, inv_m) =
            (lanes_at::<P>(weights.m, group).widen(), lanes_at::<P>(weights.inv_m, group).widen());
        let wind = weights.wind.map(W::splat);
        self.change += m * dot(change, change);
        self.own += dot(new, new).where_positive(inv_m);
        self.along += dot(new, wind).where_positive(inv_m);
    }

    #[inline(always)]
    pub(crate) fn block(self) -> Moved {
        let Self { error, change, own, along, largest } = self;
        let [error, change, own, along] = [error, change, own, along].map(|lanes| add_lanes(lanes.store()));
        let largest = largest.store();
        let largest = (0..LANES).fold(0.0, |greatest, lane| f64::max(greatest, largest[lane]));
        Moved { error, change, own, along, largest }
    }
}
