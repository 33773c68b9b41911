//! How far a sub-step that is tried moves particles, found block by block where velocities are at hand.

use super::numbers::StepNumbers;
use crate::{
    linalg::{lane_sums, lanes_at},
    math::{LANES, Pack, Real, array::dot, three},
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
    /// u.(c I + B) u (W): what drag and air take at u.
    own: f64,
    /// u.(c w + B w + f) (W): what they, and given forces, give.
    along: f64,
    /// Of the air and given forces alone, what they give less what they take (W): at u, or at each kick of an explicit step.
    external: f64,
    /// What the medium and given forces give (W) in the kicks of an explicit step, as its method accounts for it.
    medium: f64,
    /// The greatest |e|², in the square of the unit of e.
    largest: f64,
}

impl Moved {
    /// The same after another kick, whose error it is that counts.
    pub(crate) fn and(self, kick: Self) -> Self {
        Self { external: self.external + kick.external, medium: self.medium + kick.medium, ..kick }
    }

    /// That of all blocks of all ranks.
    fn of_all(share: &Share, blocks: &[Self]) -> Self {
        let here = share.own().blocks(blocks).iter().map(|block| block.largest).fold(0.0, f64::max);
        let sums =
            |block: &Self| [block.error, block.change, block.own, block.along, block.external, block.medium];
        let mut largest = 0.0;
        let [error, change, own, along, external, medium] =
            share.sum_and_tell(blocks, &sums, [here], |[of_rank]| largest = f64::max(largest, of_rank));
        Self { error, change, own, along, external, medium, largest }
    }
}

/// How a sub-step moves the free particles of a cloth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Motion {
    /// Estimated error of positions.
    pub(crate) error: ErrorEstimate,
    /// |u - V|² m / 2 (J), of an implicit step: of implicit Euler |v' - v|² m / 2. Of explicit Euler |a|² m / 2 (J/s²).
    pub(crate) change: f64,
    /// u.(c I + B) u (W), of an implicit step: of implicit Euler u = v'.
    pub(crate) own: f64,
    /// u.(c w + B w + f) (W), likewise.
    pub(crate) along: f64,
    /// Mean power (W) of the air and given forces in the sub-step, of any step.
    pub(crate) external: f64,
    /// Mean power (W) of the medium and given forces, of an explicit step, as its method accounts for it.
    pub(crate) medium: f64,
}

impl Motion {
    /// From the sums of all blocks: the error of a particle is `scale` times the length of what its block added up.
    pub(crate) fn of(share: &Share, blocks: &[Moved], free_count: usize, scale: f64) -> Self {
        let Moved { error, change, own, along, external, medium, largest } = Moved::of_all(share, blocks);
        let rms = scale * (error / free_count.max(1) as f64).sqrt();
        let error = ErrorEstimate { rms, largest: scale * largest.sqrt(), of_solve: 0.0 };
        Self { error, change: 0.5 * change, own, along, external, medium }
    }
}

/// Masses and the medium, of an implicit step.
#[derive(Clone, Copy)]
pub(crate) struct Weights<'a, R: Real> {
    /// Mass (kg) and its inverse, 0 for pins, of the particles of a block.
    pub(crate) m: &'a [R],
    pub(crate) inv_m: &'a [R],
    pub(crate) numbers: &'a StepNumbers<R>,
    /// Which group of sixteen the block begins with.
    pub(crate) first: usize,
}

/// Sums of a block, in lanes: those of [`Moved`].
pub(crate) struct MovedSums<W> {
    error: W,
    change: W,
    own: W,
    along: W,
    external: W,
    medium: W,
    largest: W,
}

impl<W: Pack<Number = f64>> MovedSums<W> {
    #[inline(always)]
    pub(crate) fn none() -> Self {
        let zero = W::zero();
        Self {
            error: zero,
            change: zero,
            own: zero,
            along: zero,
            external: zero,
            medium: zero,
            largest: zero,
        }
    }

    /// Adds what the error of sixteen particles is proportional to.
    #[inline(always)]
    pub(crate) fn add_error(&mut self, of: [W; 3]) {
        let square = dot(of, of);
        self.error += square;
        self.largest = self.largest.max(square);
    }

    /// Adds what the medium and given forces, as they are at velocities `at`, do in a kick between two velocities: a share of the
    /// sub-step's mean power. A method accounts for them at two velocities, which are those of the kick but for explicit Euler.
    #[inline(always)]
    pub(crate) fn add_kick<P: Pack<Wide = W>>(
        &mut self,
        (numbers, place): (&StepNumbers<P::Number>, usize),
        at: [P; 3],
        [before, after, accounted]: [[P; 3]; 3],
        (inv_m, share): (P, f64),
    ) {
        if numbers.external.is_still() {
            return;
        }
        let medium = numbers.external.at::<P>(place).widen();
        let (at, before, after) = (P::widen3(at), P::widen3(before), P::widen3(after));
        let (accounted, inv_m) = (P::widen3(accounted), inv_m.widen());
        let (kick, half) = (three!(|c| before[c] + after[c]), W::of(0.5 * share));
        let both = three!(|c| before[c] + accounted[c]);
        self.external += (dot(medium.without_drag().force(at), kick) * half).where_positive(inv_m);
        self.medium += (dot(medium.force(at), both) * half).where_positive(inv_m);
    }

    /// Adds the change of sixteen velocities of these masses.
    #[inline(always)]
    pub(crate) fn add_change(&mut self, m: W, change: [W; 3]) {
        self.change += m * dot(change, change);
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
        self.add_change(m, change);
        let medium = weights.numbers.external.at::<P>(weights.first + group).widen();
        let [own, along] = medium.powers(new, W::one());
        let [taken, given] = medium.without_drag().powers(new, W::one());
        self.external += (given - taken).where_positive(inv_m);
        self.own += own.where_positive(inv_m);
        self.along += along.where_positive(inv_m);
    }

    #[inline(always)]
    pub(crate) fn block(self) -> Moved {
        let Self { error, change, own, along, external, medium, largest } = self;
        let [error, change, own, along, external, medium] =
            lane_sums([error, change, own, along, external, medium]);
        let largest = largest.store();
        let largest = (0..LANES).fold(0.0, |greatest, lane| f64::max(greatest, largest[lane]));
        Moved { error, change, own, along, external, medium, largest }
    }
}
