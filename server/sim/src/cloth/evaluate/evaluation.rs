//! The evaluation of a state, in one sweep over springs: what a step starts from, and what it reports.
//!
//! Reads positions (m), velocities (m/s) and laws; writes accelerations for an explicit step, or for an implicit one
//! the right-hand side, the inverse diagonal blocks and the frozen tangent of its matrix; with either the energies, the
//! momentum, the largest stretch and the check that all is finite. Every sum is binary64 over fixed blocks.
#![allow(unsafe_code, reason = "blocks write slots that no other block has")]

use std::marker::PhantomData;

use super::{
    bound::{Bound, Fastest, MOVES},
    figures::{Figures, Partial, Total},
    numbers::StepNumbers,
    spring_sums::SpringSums,
};
use crate::{
    cloth::{
        laws::Stretch,
        layout::{BlockOfRows, BlockScratch, ElementFigures, Elements, Model, Scratches},
        settings::{Aim, Bounded, Explicit, Implicit, Purpose, Resultant, RightHandSide},
    },
    linalg::{Inverse3, PreconditionerKind, lane_sums, lanes_at, load_six, packs_at, widen_six},
    math::{LANES, Pack, Padded, Real, Sixteen, WithSimd, dispatch, three},
    parallel::{Disjoint, block_count, per_block_mut, per_sixteen_mut, size},
    report::{BoundKind, Diagnostics},
};

/// What is known of a state.
#[derive(Clone, Debug, Default)]
pub(crate) struct Evaluation<R: Real> {
    /// Explicit: accelerations (m/s²). Implicit: h (f + m g + h df/dx v) (N s). Iterate: h (f + m g) (N s). 0 for pins.
    /// Resultant: f + m g (N), for pins too.
    pub(crate) rows: Vec<Sixteen<R>>,
    /// With a matrix: inverses of its diagonal blocks (1/kg).
    pub(crate) inverse: Vec<Inverse3>,
    /// With a matrix: b of the block a I + b d dᵀ (kg/m²) that each spring adds to the matrix, by slot.
    pub(crate) tangent: Vec<[R; LANES]>,
    /// With a matrix: what elements freeze, list after list.
    pub(crate) frozen: Vec<[R; LANES]>,
    /// Sums over all particles; the kinetic energy is not a number where anything is not.
    pub(crate) total: Total,
    /// The largest length over rest length, of springs and of elements that resist stretching.
    pub(crate) max_stretch: f64,
    /// The largest component of any position (m), without its sign.
    pub(crate) largest_coordinate: f64,
    /// Bounded: what limits the step to what is stable.
    pub(crate) bound: Bound,
    /// Bounded: what limits it to what springs can follow.
    pub(crate) speed: Bound,
    /// Evaluations since the step of the world began.
    pub(crate) runs: u64,
    /// With them those of the two regions of the first bound, and the second.
    partials: Vec<(Partial, [Bound; 3])>,
}

impl<R: Real> Evaluation<R> {
    pub(crate) fn size_for(&mut self, model: &Model<R>, purpose: Purpose) {
        let groups = Sixteen::<R>::count_for(model.count);
        size(&mut self.rows, groups);
        self.partials.resize(block_count(model.count, model.block_size), Default::default());
        if purpose.has_matrix() {
            size(&mut self.inverse, groups);
            size(&mut self.tangent, model.springs.slot_count());
            let frozen = model.elements.iter().map(Elements::frozen_count).sum();
            size(&mut self.frozen, frozen);
        }
    }

    /// Freezes the air at positions and velocities, of which neighbours have computed what own rows read, and evaluates them.
    pub(crate) fn run_in_air(
        &mut self,
        model: &Model<R>,
        numbers: &mut StepNumbers<R>,
        purpose: Purpose,
        [x, v]: [&mut [Padded<R>]; 2],
        scratches: &Scratches<R>,
    ) {
        model.share.exchange([&mut *x, &mut *v]);
        numbers.external.freeze_air(model, [x, v], scratches);
        self.look(model, numbers, purpose, [x, v], scratches);
    }

    /// Evaluates positions and velocities, of which neighbours have computed what own rows read, with the air as it was frozen.
    pub(crate) fn run(
        &mut self,
        model: &Model<R>,
        numbers: &StepNumbers<R>,
        purpose: Purpose,
        [x, v]: [&mut [Padded<R>]; 2],
        scratches: &Scratches<R>,
    ) {
        model.share.exchange([&mut *x, &mut *v]);
        self.look(model, numbers, purpose, [x, v], scratches);
    }

    /// The same where all that is read is known here.
    pub(crate) fn look(
        &mut self,
        model: &Model<R>,
        numbers: &StepNumbers<R>,
        purpose: Purpose,
        [x, v]: [&[Padded<R>]; 2],
        scratches: &Scratches<R>,
    ) {
        self.runs += 1;
        let Self { rows, inverse, tangent, frozen, partials, .. } = self;
        let (tangent, frozen, own) = (Disjoint::new(tangent), &Disjoint::new(frozen), model.share.own());
        let fields = (per_block_mut(partials), per_sixteen_mut(rows), per_sixteen_mut(inverse));
        let scratch = || scratches.take();
        own.each_with(scratch, fields, |scratch, number, (partial, rows, inverse)| {
            let tangent: &mut [[R; LANES]] = if purpose.has_matrix() {
                // SAFETY: a block has slots of its own.
                unsafe { tangent.range(model.springs.slots(number)) }
            } else {
                &mut []
            };
            let side = match purpose {
                Purpose::Implicit(_) if numbers.scheme.beyond > 1.0 => RightHandSide::ExactStep,
                Purpose::Implicit(_) => RightHandSide::Step,
                Purpose::Explicit | Purpose::Resultant | Purpose::Bounded(_) | Purpose::Iterate(_) => {
                    RightHandSide::Forces
                }
            };
            let work = Block { model, numbers, side, number, x, v, rows, inverse, tangent, frozen, scratch };
            let (none, identity) = (BoundKind::Frame, PreconditionerKind::Identity);
            *partial = match purpose {
                Purpose::Explicit => dispatch(Sweep::new(work, Explicit, identity, none)),
                Purpose::Resultant => dispatch(Sweep::new(work, Resultant, identity, none)),
                Purpose::Bounded(kind) => dispatch(Sweep::new(work, Bounded, identity, kind)),
                Purpose::Implicit(kind) | Purpose::Iterate(kind) => {
                    dispatch(Sweep::new(work, Implicit, kind, none))
                }
            };
        });

        // A maximum has no order; NaN, which it would lose, shows in the sums.
        let of_own = own.blocks(partials);
        let greatest =
            |of: fn(&Partial) -> f64| of_own.iter().map(|(block, _)| of(block)).fold(0.0, f64::max);
        let greater = |a: [Bound; 3], b: [Bound; 3]| three!(|i| a[i].or(b[i]));
        let [a, b, c] =
            of_own.iter().fold([Bound::default(); 3], |all, (_, of_block)| greater(all, *of_block));
        let [stretch, coordinate] =
            [greatest(|block| block.stretch), greatest(|block| block.largest_coordinate)];
        let [p, q, r] = [a, b, c].map(|bound| f64::from(bound.particle));
        let [by_a, by_b] = [a, b].map(|bound| f64::from(u8::from(bound.by_air)));
        let told = [stretch, coordinate, a.rate, p, by_a, b.rate, q, by_b, c.rate, r];
        (self.max_stretch, self.largest_coordinate) = (0.0, 0.0);
        let mut bounds = [Bound::default(); 3];
        let Self { partials, max_stretch, largest_coordinate, .. } = self;
        let sums = model.share.sum_and_tell(partials, &|(block, _)| block.sums, told, |told| {
            let [stretch, coordinate, a, p, by_a, b, q, by_b, c, r] = told;
            *max_stretch = max_stretch.max(stretch);
            *largest_coordinate = largest_coordinate.max(coordinate);
            let of_rank = [(a, p, by_a), (b, q, by_b), (c, r, 0.0)];
            let of_rank = of_rank.map(|(rate, particle, by_air)| Bound {
                rate,
                particle: particle as u32,
                by_air: by_air > 0.0,
            });
            bounds = greater(bounds, of_rank);
        });
        self.total = Total::of(sums);
        (self.bound, self.speed) = (bounds[0].either(bounds[1]), bounds[2]);
    }

    pub(crate) fn diagnostics(&self) -> Diagnostics {
        let Total { kinetic_energy, elastic_energy, gravitational_energy, momentum, .. } = self.total;
        let max_stretch = self.max_stretch;
        let external_work = 0.0;
        Diagnostics {
            kinetic_energy,
            elastic_energy,
            gravitational_energy,
            momentum,
            max_stretch,
            external_work,
        }
    }
}

/// A block, and what is written of it.
struct Block<'a, R: Real> {
    model: &'a Model<R>,
    numbers: &'a StepNumbers<R>,
    side: RightHandSide,
    number: usize,
    x: &'a [Padded<R>],
    v: &'a [Padded<R>],
    rows: &'a mut [Sixteen<R>],
    inverse: &'a mut [Inverse3],
    tangent: &'a mut [[R; LANES]],
    frozen: &'a Disjoint<'a, [R; LANES]>,
    scratch: &'a mut BlockScratch<R>,
}

/// A block to be evaluated.
struct Sweep<'a, R: Real, A> {
    block: Block<'a, R>,
    /// Of the inverses of the diagonal blocks, with a matrix.
    kind: PreconditionerKind,
    /// Of the bound, where there is one.
    bound: BoundKind,
    aim: PhantomData<A>,
}

impl<'a, R: Real, A: Aim> Sweep<'a, R, A> {
    fn new(block: Block<'a, R>, _: A, kind: PreconditionerKind, bound: BoundKind) -> Self {
        Self { block, kind, bound, aim: PhantomData }
    }
}

impl<R: Real, A: Aim> WithSimd<R> for Sweep<'_, R, A> {
    type Output = (Partial, [Bound; 3]);

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> (Partial, [Bound; 3]) {
        self.block.sums::<P, A>(self.kind, self.bound)
    }
}

impl<R: Real> Block<'_, R> {
    #[inline(always)]
    fn sums<P: Pack<Number = R>, A: Aim>(
        mut self,
        kind: PreconditionerKind,
        bound: BoundKind,
    ) -> (Partial, [Bound; 3]) {
        let springs = &self.model.springs;
        self.rows.fill(Sixteen::default());
        if A::HAS_MATRIX {
            self.scratch.diagonal.fill([[0.0; LANES]; 6]);
        }
        if A::IS_BOUNDED {
            self.scratch.bounds.fill([[[R::zero(); LANES]; 6]; 2]);
            self.scratch.rates.fill([R::zero(); LANES]);
        }

        let mut fold = SpringSums::<P, A> {
            springs,
            laws: &self.numbers.springs,
            along: &self.numbers.along,
            bounds: &self.numbers.bounds.springs,
            mirror: P::splat(self.numbers.mirror),
            side: self.side,
            first_slot: springs.slots(self.number).start,
            tangent: self.tangent,
            rows: self.rows,
            diagonal: &mut self.scratch.diagonal,
            stiffness: &mut self.scratch.bounds,
            rates: &mut self.scratch.rates,
            energy: P::Wide::zero(),
            power: P::Wide::zero(),
            stretch: Stretch::none(),
            aim: PhantomData,
        };
        springs.fold_block::<P>(self.number, [self.x, self.v], &mut self.scratch.records, &mut fold);
        let (energy, power, mut stretch) = (fold.energy, fold.power, fold.stretch.greatest());
        // Both ends count a spring.
        let mut elastic = lane_sums([energy, power]).map(|sum| 0.5 * sum);
        if !self.model.elements.is_empty() {
            let figures = self.add_elements::<P, A>();
            elastic = [elastic[0] + figures.energy, elastic[1] + figures.power];
            stretch = stretch.max(figures.stretch);
        }

        let mut figures = Figures::<P::Wide>::new(self.numbers);
        let [mut line, mut corner, mut fastest] = [Fastest::none(); 3];
        for group in 0..self.rows.len() {
            if A::IS_BOUNDED {
                let place = self.number * self.model.block_size + group * LANES;
                let [m, inv_m] = [&self.model.m, &self.model.inv_m];
                let masses =
                    [lanes_at::<P>(m, place / LANES).widen(), lanes_at::<P>(inv_m, place / LANES).widen()];
                let sums = &self.scratch.bounds[group];
                let entries = [widen_six::<P>(&sums[0]), widen_six::<P>(&sums[1])];
                let bounds = &self.numbers.bounds;
                let in_vacuum = bounds.rates(place, entries, masses, bound, None);
                // No closure: it would not be compiled for the instructions of the kernel.
                let rates = match self.numbers.external.at::<P>(place / LANES).widen().air {
                    Some(air) => bounds.rates(place, entries, masses, bound, Some(air)),
                    None => in_vacuum,
                };
                line.look(group, rates[0], in_vacuum[0]);
                corner.look(group, rates[1], in_vacuum[1]);
                let speed = P::load(&self.scratch.rates[group]).widen().sqrt() * P::Wide::of(1.0 / MOVES);
                let speed = speed.where_positive(masses[1]);
                fastest.look(group, speed, speed);
            }
            self.finish::<P, A>(group, kind, &mut figures);
        }
        let first = self.number * self.model.block_size;
        let bounds = [line.bound(first), corner.bound(first), fastest.bound(first)];
        (figures.partial(elastic, stretch), bounds)
    }

    /// Adds the elements to the sums of the rows; returns their energy, and what they say beside it.
    #[inline(always)]
    fn add_elements<P: Pack<Number = R>, A: Aim>(&mut self) -> ElementFigures {
        let rows = self.rows.len() * LANES;
        let (mut sums, mut first) = (ElementFigures::default(), 0);
        let side = (self.side, self.numbers.mirror);
        self.scratch.corners.clear(rows);
        for (elements, numbers) in self.model.elements.iter().zip(&self.numbers.elements) {
            let range = elements.frozen(self.number);
            let frozen: &mut [[R; LANES]] = if A::FREEZES {
                // SAFETY: lists and blocks have ranges of their own.
                unsafe { self.frozen.range(first + range.start..first + range.end) }
            } else {
                &mut []
            };
            let at = BlockOfRows { block: self.number, rows, group: None, fields: [self.x, self.v] };
            sums = sums.and(elements.evaluate::<P, A>(at, numbers, side, frozen, self.scratch));
            first += elements.frozen_count();
        }

        let BlockScratch { corners, diagonal, .. } = &mut *self.scratch;
        for (group, row) in self.rows.iter_mut().enumerate() {
            let (own, added) = (row.load::<P>(), corners.sixteen::<P>(group));
            row.store(three!(|c| own[c] + added[c]));
            if A::HAS_MATRIX {
                corners.add_blocks_to(group, &mut diagonal[group]);
            }
        }
        sums
    }

    /// Adds to the springs of sixteen rows what acts on each particle by itself.
    #[inline(always)]
    fn finish<P: Pack<Number = R>, A: Aim>(
        &mut self,
        group: usize,
        kind: PreconditionerKind,
        figures: &mut Figures<P::Wide>,
    ) {
        let StepNumbers { scheme, gravity, .. } = *self.numbers;
        let place = self.number * (self.model.block_size / LANES) + group;
        let [x, v] = [packs_at::<P>(self.x, place), packs_at::<P>(self.v, place)];
        let [m, inv_m] = [lanes_at::<P>(&self.model.m, place), lanes_at::<P>(&self.model.inv_m, place)];
        figures.add([P::widen3(x), P::widen3(v)], m.where_positive(inv_m).widen());

        let springs = self.rows[group].load::<P>();
        let medium = self.numbers.external.at::<P>(place);
        let force = medium.force(v);
        let moves = lanes_at::<P>(self.model.movable(), place);
        if A::KEEPS_FORCES {
            // The mass by which corners of figures give way is no weight, and the medium does not act on them.
            let led = moves - inv_m;
            let m = m - m.where_positive(led);
            let force = three!(|c| force[c] - force[c].where_positive(led));
            self.rows[group].store(three!(|c| m * gravity[c] + springs[c] + force[c]));
            return;
        }
        if A::HAS_MATRIX {
            let (h, medium) = (R::of(scheme.h), medium.on_free(inv_m).widen());
            let masses = [m.where_positive(inv_m).widen(), inv_m.widen()];
            figures.predict(self.side, P::widen3(v), P::widen3(springs), masses, &medium);
            self.rows[group]
                .store(three!(|c| ((m * gravity[c] + force[c]) * h + springs[c]).where_positive(inv_m)));
            let mut block = load_six::<P::Wide>(&self.scratch.diagonal[group]);
            medium.add_to(&mut block, m.widen(), P::Wide::of(scheme.h));
            self.inverse[group] = Inverse3::of_packs(block, kind, moves.widen());
        } else {
            let accelerations =
                three!(|c| ((springs[c] + force[c]) * inv_m + P::splat(gravity[c])).where_positive(inv_m));
            let masses = [m.where_positive(inv_m).widen(), inv_m.widen()];
            if A::IS_BOUNDED {
                figures.work(P::widen3(v), P::widen3(springs), P::widen3(accelerations), masses);
            }
            figures.push_pins(P::widen3(springs), masses[1]);
            self.rows[group].store(accelerations);
        }
    }
}
