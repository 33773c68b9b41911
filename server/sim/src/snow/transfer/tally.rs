//! What a step counts and measures of its particles, chunk by chunk.
//!
//! Reads what a group has after a step; writes extremes, which bound the next step, and counts.

use crate::{
    math::{LANES, Pack, Real},
    report::Notices,
    snow::{bound::Extremes, particles::Lanes},
};

/// Sums and extremes over the particles of a chunk of blocks, a number per lane.
#[derive(Clone, Copy)]
pub(crate) struct Tally<R> {
    /// As in [`Extremes`].
    extremes: [Lanes<R>; 5],
    /// Smallest and largest J_P.
    plastic_ratio_range: [Lanes<R>; 2],
    /// Yielded, clamped, inverted, ballistic.
    counts: [Lanes<R>; 4],
}

/// The same after the last group.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ChunkDiagnostics {
    pub(crate) extremes: Extremes,
    /// Smallest and largest J_P.
    pub(crate) plastic_ratio_range: [f64; 2],
    /// Yielded, clamped, inverted, ballistic.
    pub(crate) counts: [u32; 4],
    /// Particles that went through a collider, in the user's numbering of the snow.
    pub(crate) notices: Notices,
}

impl<R: Real> Tally<R> {
    pub(crate) fn new() -> Self {
        let (zero, largest) = ([R::zero(); LANES], [R::of(R::LARGEST); LANES]);
        let lowest = [R::of(-R::LARGEST); LANES];
        Self { extremes: [zero; 5], plastic_ratio_range: [largest, lowest], counts: [zero; 4] }
    }

    pub(crate) fn finish(&self) -> ChunkDiagnostics {
        let greatest =
            |lanes: &Lanes<R>| lanes.iter().fold(f64::NEG_INFINITY, |most, x| most.max(x.to_f64()));
        let least = |lanes: &Lanes<R>| lanes.iter().fold(f64::INFINITY, |least, x| least.min(x.to_f64()));
        let count = |lanes: &Lanes<R>| lanes.iter().map(|x| x.to_f64() as u32).sum();
        ChunkDiagnostics {
            extremes: Extremes::of(self.extremes.each_ref().map(greatest)),
            plastic_ratio_range: [
                least(&self.plastic_ratio_range[0]),
                greatest(&self.plastic_ratio_range[1]),
            ],
            counts: self.counts.each_ref().map(count),
            notices: Notices::default(),
        }
    }

    /// Adds a group: extremes from what is stored, so that a run restored from its particles takes
    /// the same steps.
    #[inline(always)]
    pub(crate) fn include<P: Pack<Number = R>>(
        &mut self,
        count: usize,
        extremes: [P; 5],
        plastic_ratio: P,
        counts: [P; 4],
    ) {
        let mut active = [R::zero(); LANES];
        active[..count].fill(R::one());

        // Lanes past the last particle hold what is nobody's.
        let (active, zero) = (P::load(&active), P::zero());
        for k in 0..5 {
            let own = zero.if_less(active, extremes[k], zero);
            // In this order what is not a number is passed over.
            self.extremes[k] = own.max(P::load(&self.extremes[k])).store();
        }

        let [least, most] = [P::load(&self.plastic_ratio_range[0]), P::load(&self.plastic_ratio_range[1])];
        self.plastic_ratio_range[0] = zero.if_less(active, plastic_ratio.min(least), least).store();
        self.plastic_ratio_range[1] = zero.if_less(active, plastic_ratio.max(most), most).store();
        for k in 0..4 {
            self.counts[k] = (P::load(&self.counts[k]) + counts[k] * active).store();
        }
    }
}
