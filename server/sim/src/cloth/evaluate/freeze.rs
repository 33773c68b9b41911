//! The tangent of springs frozen anew where it was evaluated, with compressed ones treated otherwise.
//!
//! Reads positions (m) and the numbers of a step; writes b (kg/m²) of the block a I + b d dᵀ of each spring. The inverse
//! diagonal blocks stay those of the evaluation, and so does all else.
#![allow(unsafe_code, reason = "blocks write slots that no other block has")]

use super::{
    evaluation::Evaluation,
    numbers::{SpringNumbers, StepNumbers},
};
use crate::{
    cloth::{
        laws::Spring,
        layout::{Fold, Model, Scratches, Springs},
    },
    math::{LANES, Pack, Padded, Real, Record, WithSimd, dispatch},
    parallel::{Disjoint, per_sixteen},
};

impl<R: Real> Evaluation<R> {
    /// Freezes springs at the positions that were evaluated: `mirror` is what a negative transverse ratio is multiplied by,
    /// 1 to leave it, -1 for its absolute value.
    pub(crate) fn freeze_springs(
        &mut self,
        model: &Model<R>,
        numbers: &StepNumbers<R>,
        x: &[Padded<R>],
        mirror: f64,
        scratches: &Scratches<R>,
    ) {
        let Self { tangent, rows, .. } = self;
        let tangent = Disjoint::new(tangent);
        let scratch = || scratches.take();
        model.share.own().each_with(scratch, per_sixteen(rows), |scratch, number, _| {
            // SAFETY: a block has slots of its own.
            let tangent = unsafe { tangent.range(model.springs.slots(number)) };
            let records = &mut scratch.records;
            dispatch(FreezeBlock { model, numbers, number, x, mirror: R::of(mirror), tangent, records });
        });
    }
}

/// A block whose springs are to be frozen.
struct FreezeBlock<'a, R: Real> {
    model: &'a Model<R>,
    numbers: &'a StepNumbers<R>,
    number: usize,
    x: &'a [Padded<R>],
    mirror: R,
    tangent: &'a mut [[R; LANES]],
    records: &'a mut [Record<R>],
}

impl<R: Real> WithSimd<R> for FreezeBlock<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let springs = &self.model.springs;
        let mut fold = Freeze::<P> {
            springs,
            laws: &self.numbers.springs,
            mirror: P::splat(self.mirror),
            first_slot: springs.slots(self.number).start,
            tangent: self.tangent,
        };
        springs.fold_block::<P>(self.number, [self.x, self.x], self.records, &mut fold);
    }
}

struct Freeze<'a, P: Pack> {
    springs: &'a Springs<P::Number>,
    laws: &'a [SpringNumbers<P::Number>],
    mirror: P,
    first_slot: usize,
    tangent: &'a mut [[P::Number; LANES]],
}

impl<P: Pack> Fold<P> for Freeze<'_, P> {
    /// Nothing is added up.
    type Sums = ();

    #[inline(always)]
    fn sums(&self, _: [usize; 2]) {}

    #[inline(always)]
    fn add(&mut self, (): &mut (), [slot, _]: [usize; 2], d: [P; 3], _: [P; 3]) {
        let law = &self.laws[self.springs.pattern_of[slot] as usize];
        let spring = Spring::new(d, P::load(&self.springs.rest_lengths[slot]));
        let [_, b] = spring.tangent(P::load(&law.elastic), P::load(&law.viscous), self.mirror);
        self.tangent[slot - self.first_slot] = b.store();
    }

    #[inline(always)]
    fn keep(&mut self, _: [usize; 2], (): ()) {}
}
