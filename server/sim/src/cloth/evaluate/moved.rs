//! How far a sub-step that is tried moves particles, found block by block where velocities are at hand.

use crate::{
    linalg::{add_lanes, lanes_at},
    math::{LANES, Pack, array::dot},
    parallel::Share,
    report::ErrorEstimate,
};

/// Sums of a block over its free particles: [`Motion`] says of what.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moved {
    sums: [f64; 4],
    largest: f64,
}

impl Moved {
    pub(crate) fn new(sums: [f64; 4], largest: f64) -> Self {
        Self { sums, largest }
    }

    pub(crate) fn sums(&self) -> [f64; 4] {
        self.sums
    }

    pub(crate) fn largest(&self) -> f64 {
        self.largest
    }

    /// The sums of all blocks, and the largest of what they found.
    pub(crate) fn gather(share: &Share, blocks: &[Self]) -> ([f64; 4], f64) {
        let own = share.own().blocks(blocks).iter().map(Self::largest).fold(0.0, f64::max);
        let mut largest = 0.0;
        let sums = share.gather(blocks, &Self::sums, [own], |[of_rank]| largest = f64::max(largest, of_rank));
        (sums, largest)
    }
}

/// How a sub-step moves the free particles of a cloth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Motion {
    /// Estimated error of positions.
    pub(crate) error: ErrorEstimate,
    /// |u - V|² m / 2 (J), of an implicit step: of implicit Euler |v' - v|² m / 2. Of explicit Euler |a|² m / 2 (J/s²).
    pub(crate) change: f64,
    /// |u|² and u.wind (m²/s²), of an implicit step: of implicit Euler u = v'.
    pub(crate) medium: [f64; 2],
}

impl Motion {
    /// From the sums of all blocks: the error of a particle is `scale` times the length of what its block added up.
    pub(crate) fn of(share: &Share, blocks: &[Moved], free_count: usize, scale: f64) -> Self {
        let ([square, change, own, along], largest) = Moved::gather(share, blocks);
        let rms = scale * (square / free_count.max(1) as f64).sqrt();
        let error = ErrorEstimate { rms, largest: scale * largest.sqrt() };
        Self { error, change: 0.5 * change, medium: [own, along] }
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

/// Sums of a block, in lanes.
pub(crate) struct MovedSums<W> {
    sums: [W; 4],
    largest: W,
}

impl<W: Pack<Number = f64>> MovedSums<W> {
    #[inline(always)]
    pub(crate) fn none() -> Self {
        Self { sums: [W::zero(); 4], largest: W::zero() }
    }

    /// Adds what the error of sixteen particles is proportional to.
    #[inline(always)]
    pub(crate) fn add_error(&mut self, of: [W; 3]) {
        let square = dot(of, of);
        self.sums[0] += square;
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
        self.sums[1] += m * dot(change, change);
        self.sums[2] += dot(new, new).where_positive(inv_m);
        self.sums[3] += dot(new, wind).where_positive(inv_m);
    }

    #[inline(always)]
    pub(crate) fn block(self) -> Moved {
        let sums = self.sums.map(|lanes| add_lanes(lanes.store()));
        let largest = self.largest.store();
        Moved { sums, largest: (0..LANES).fold(0.0, |greatest, lane| f64::max(greatest, largest[lane])) }
    }
}
