//! The tangent of springs and elements frozen anew where it was evaluated, compressed ones otherwise.
//!
//! Reads positions (m) and the numbers of a step; writes b (kg/m²) of the block a I + b d dᵀ of each spring, and what elements
//! freeze whose tangents change. The inverse diagonal blocks stay those of the evaluation, and so does all else.
#![allow(unsafe_code, reason = "blocks write slots that no other block has")]

use super::{
    evaluation::Evaluation,
    numbers::{SpringNumbers, StepNumbers},
};
use crate::{
    cloth::{
        laws::Spring,
        layout::{BlockOfRows, BlockScratch, Fold, Model, Scratches, Springs},
    },
    math::{LANES, Pack, Padded, Real, WithSimd, dispatch},
    parallel::{Disjoint, per_sixteen},
};

impl<R: Real> Evaluation<R> {
    /// Freezes springs and elements at the positions that were evaluated: `mirror` is what a negative transverse ratio is
    /// multiplied by, 1 to leave it, -1 for its absolute value.
    pub(crate) fn freeze_again(
        &mut self,
        model: &Model<R>,
        numbers: &StepNumbers<R>,
        x: &[Padded<R>],
        mirror: f64,
        scratches: &Scratches<R>,
    ) {
        let Self { tangent, frozen, rows, .. } = self;
        let (tangent, frozen, mirror) = (Disjoint::new(tangent), &Disjoint::new(frozen), R::of(mirror));
        let scratch = || scratches.take();
        model.share.own().each_with(scratch, per_sixteen(rows), |scratch, number, rows| {
            // SAFETY: a block has slots of its own.
            let tangent = unsafe { tangent.range(model.springs.slots(number)) };
            let rows = rows.len() * LANES;
            dispatch(FreezeBlock { model, numbers, number, rows, x, mirror, tangent, frozen, scratch });
        });
    }
}

/// A block whose springs and elements are to be frozen.
struct FreezeBlock<'a, R: Real> {
    model: &'a Model<R>,
    numbers: &'a StepNumbers<R>,
    number: usize,
    rows: usize,
    x: &'a [Padded<R>],
    mirror: R,
    tangent: &'a mut [[R; LANES]],
    frozen: &'a Disjoint<'a, [R; LANES]>,
    scratch: &'a mut BlockScratch<R>,
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
        let fields = [self.x, self.x];
        springs.fold_block::<P>(self.number, fields, &mut self.scratch.records, &mut fold);

        let (at, mut first) = (BlockOfRows { block: self.number, rows: self.rows, group: None, fields }, 0);
        for (elements, numbers) in self.model.elements.iter().zip(&self.numbers.elements) {
            let (range, count) = (elements.frozen(self.number), elements.frozen_count());
            if count > 0 {
                // SAFETY: lists and blocks have ranges of their own.
                let frozen = unsafe { self.frozen.range(first + range.start..first + range.end) };
                elements.freeze::<P>(at, numbers, self.mirror, frozen, self.scratch);
            }
            first += count;
        }
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
