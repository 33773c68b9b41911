//! What an evaluation adds up over springs: of each row its force or its part of the right-hand side, its diagonal block
//! or what bounds its step; of all of them energy, power and the largest stretch.

use std::marker::PhantomData;

use super::{
    bound::{SpringBounds, add_spring},
    numbers::SpringNumbers,
};
use crate::{
    cloth::{
        laws::{Spring, Stretch},
        layout::{Fold, Springs},
        settings::{Aim, RightHandSide},
    },
    linalg::load_six,
    math::{LANES, Pack, Sixteen, array::dot},
};

/// Sums over the springs of a block.
pub(crate) struct SpringSums<'a, P: Pack, A: Aim> {
    pub(crate) springs: &'a Springs<P::Number>,
    pub(crate) laws: &'a [SpringNumbers<P::Number>],
    pub(crate) along: &'a [[P::Number; LANES]],
    pub(crate) bounds: &'a [SpringBounds<P::Number>],
    pub(crate) mirror: P,
    pub(crate) side: RightHandSide,
    pub(crate) first_slot: usize,
    pub(crate) tangent: &'a mut [[P::Number; LANES]],
    pub(crate) rows: &'a mut [Sixteen<P::Number>],
    pub(crate) diagonal: &'a mut [[[f64; LANES]; 6]],
    pub(crate) stiffness: &'a mut [[[[P::Number; LANES]; 6]; 2]],
    pub(crate) rates: &'a mut [[P::Number; LANES]],
    pub(crate) energy: P::Wide,
    /// Of a step from the state: h F.v. Of an iterate: the potential of the damping, h nu (rate of length)² / 2.
    pub(crate) power: P::Wide,
    pub(crate) stretch: Stretch<P>,
    pub(crate) aim: PhantomData<A>,
}

/// Sums of sixteen rows.
#[derive(Clone, Copy)]
pub(crate) struct RowSums<P: Pack> {
    /// Explicit: forces (N). Implicit: h (f + h df/dx v) (N s). Iterate: h f (N s).
    row: [P; 3],
    diagonal: [P::Wide; 6],
    /// Stiffness and damping that bound an explicit step.
    bounds: [[P; 6]; 2],
    /// The square of the greatest rate of a spring.
    rate: P,
}

impl<P: Pack, A: Aim> Fold<P> for SpringSums<'_, P, A> {
    type Sums = RowSums<P>;

    #[inline(always)]
    fn sums(&self, [group, _]: [usize; 2]) -> RowSums<P> {
        let diagonal = if A::HAS_MATRIX { load_six(&self.diagonal[group]) } else { [P::Wide::zero(); 6] };
        let (bounds, rate) = if A::IS_BOUNDED {
            let [stiffness, damping] = &self.stiffness[group];
            ([load_six(stiffness), load_six(damping)], P::load(&self.rates[group]))
        } else {
            ([[P::zero(); 6]; 2], P::zero())
        };
        RowSums { row: self.rows[group].load(), diagonal, bounds, rate }
    }

    #[inline(always)]
    fn add(&mut self, sums: &mut RowSums<P>, [slot, _]: [usize; 2], d: [P; 3], w: [P; 3]) {
        let pattern = self.springs.pattern_of[slot] as usize;
        let law = &self.laws[pattern];
        let stiffness = P::load(&law.stiffness);
        let spring = Spring::new(d, P::load(&self.springs.rest_lengths[slot]));
        if A::HAS_FIGURES {
            self.energy += spring.energy(stiffness);
            self.stretch.look(&spring);
        }

        if A::HAS_MATRIX {
            let (push, elastic) = (P::load(&law.push), P::load(&law.elastic));
            let [across, b] = spring.tangent(elastic, P::load(&law.viscous), self.mirror);
            if A::FREEZES {
                self.tangent[slot - self.first_slot] = b.store();
            }
            spring.add_block(&mut sums.diagonal, P::load(&self.along[pattern]), b);

            // h f, and h² df/dx v without the damping: b d.v holds the damping of both.
            let (elastic_pull, along) = (spring.pull(w, push, P::zero()), dot(w, d));
            if self.side == RightHandSide::Forces {
                let slowing = spring.slowing(along, P::load(&law.viscous));
                if A::HAS_FIGURES {
                    self.power += (slowing * along).widen() * P::Wide::of(0.5);
                }
                let pull = elastic_pull + slowing;
                for c in 0..3 {
                    sums.row[c] -= pull * d[c];
                }
            } else {
                // What the matrix makes of compressed springs would cost the midpoint its order here.
                let [across, b] = if self.side == RightHandSide::ExactStep {
                    spring.tangent(elastic, P::load(&law.viscous), P::one())
                } else {
                    [across, b]
                };
                self.power -= (elastic_pull * along).widen();
                let pull = elastic_pull + b * along;
                for c in 0..3 {
                    sums.row[c] -= pull * d[c] + across * w[c];
                }
            }
        } else {
            let pull = spring.pull(w, stiffness, P::load(&law.damping));
            for c in 0..3 {
                sums.row[c] -= pull * d[c];
            }
        }
        if A::IS_BOUNDED {
            add_spring(&mut sums.bounds, &spring, &self.bounds[pattern]);
            sums.rate = sums.rate.max(spring.speed(w));
        }
    }

    #[inline(always)]
    fn keep(&mut self, [group, _]: [usize; 2], sums: RowSums<P>) {
        self.rows[group].store(sums.row);
        if A::HAS_MATRIX {
            for c in 0..6 {
                self.diagonal[group][c] = sums.diagonal[c].store();
            }
        }
        if A::IS_BOUNDED {
            for matrix in 0..2 {
                for c in 0..6 {
                    self.stiffness[group][matrix][c] = sums.bounds[matrix][c].store();
                }
            }
            self.rates[group] = sums.rate.store();
        }
    }
}
