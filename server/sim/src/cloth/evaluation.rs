//! The evaluation of a state: what the next step starts from and what this one reports, in one sweep over the springs.
//!
//! Reads positions (m), velocities (m/s) and laws; writes accelerations for an explicit step, or for an implicit one
//! the right-hand side, the inverse diagonal blocks and the frozen tangent of its matrix; with either the energies, the
//! momentum, the largest stretch and the check that all is finite. Every sum is binary64 over fixed blocks.
#![allow(unsafe_code, reason = "blocks write slots that no other block has")]

use rayon::prelude::*;

use super::{
    elements::{BlockOfRows, Elements},
    laws::{Spring, Stretch},
    model::Model,
    numbers::{SpringNumbers, StepNumbers},
    rows::{Fold, Springs},
    scratch::{BlockScratch, Scratches},
    settings::ClothSettings,
};
use crate::{
    linalg::{Inverse3, PreconditionerKind, add_lanes, packs},
    math::{LANES, Pack, Padded, Real, Sixteen, WithSimd, array::dot, array3, dispatch, three},
    parallel::{Disjoint, block_count, sum},
    report::Diagnostics,
};

/// What an evaluation is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// A step that divides forces by masses.
    Explicit,
    /// A step that solves for the change of velocity.
    Implicit(PreconditionerKind),
}

impl Purpose {
    pub(super) const fn of(settings: &ClothSettings) -> Self {
        if settings.integrator.is_implicit() {
            Self::Implicit(settings.solver.preconditioner)
        } else {
            Self::Explicit
        }
    }
}

/// What is known of a state.
#[derive(Clone, Debug, Default)]
pub(super) struct Evaluation<R: Real> {
    /// Explicit: accelerations (m/s²). Implicit: h (f + m g + h df/dx v) (N s). 0 for pins.
    pub(super) rows: Vec<Sixteen<R>>,
    /// Implicit: inverses of the diagonal blocks of the matrix (1/kg).
    pub(super) inverse: Vec<Inverse3>,
    /// Implicit: b of the block a I + b d dᵀ (kg/m²) that each spring adds to the matrix, by slot.
    pub(super) tangent: Vec<[R; LANES]>,
    /// Implicit: what elements freeze, list after list.
    pub(super) frozen: Vec<[R; LANES]>,
    /// Energies, momentum and stretch; the kinetic energy is not a number where anything is not.
    pub(super) diagnostics: Diagnostics,
    partials: Vec<Partial>,
}

/// Sums of a block: energies (J), momentum (kg m/s, three places), the check that all is finite, the largest stretch.
type Partial = [f64; 8];

impl<R: Real> Evaluation<R> {
    pub(super) fn size_for(&mut self, model: &Model<R>, purpose: Purpose) {
        let groups = Sixteen::<R>::count_for(model.count);
        self.rows.resize(groups, Sixteen::default());
        self.partials.resize(block_count(model.count, model.block_size), Partial::default());
        if matches!(purpose, Purpose::Implicit(_)) {
            self.inverse.resize(groups, Inverse3::default());
            self.tangent.resize(model.springs.slot_count(), [R::zero(); LANES]);
            let frozen = model.elements.iter().map(Elements::frozen_count).sum();
            self.frozen.resize(frozen, [R::zero(); LANES]);
        }
    }

    /// Evaluates positions and velocities.
    pub(super) fn run(
        &mut self,
        model: &Model<R>,
        numbers: &StepNumbers<R>,
        purpose: Purpose,
        [x, v]: [&[Padded<R>]; 2],
        scratches: &Scratches<R>,
    ) {
        let Self { rows, inverse, tangent, frozen, partials, .. } = self;
        let (tangent, inverse) = (Disjoint::new(tangent), Disjoint::new(inverse));
        let frozen = &Disjoint::new(frozen);
        let groups = model.block_size / LANES;
        (partials.par_iter_mut(), rows.par_chunks_mut(groups)).into_par_iter().enumerate().for_each(
            |(block, (partial, rows))| {
                let (inverse, tangent): (&mut [Inverse3], &mut [[R; LANES]]) = match purpose {
                    Purpose::Explicit => (&mut [], &mut []),
                    // SAFETY: a block has slots and groups of its own.
                    Purpose::Implicit(_) => unsafe {
                        let first = block * groups;
                        (inverse.range(first..first + rows.len()), tangent.range(model.springs.slots(block)))
                    },
                };
                let scratch = &mut *scratches.take();
                let work =
                    Block { model, numbers, number: block, x, v, rows, inverse, tangent, frozen, scratch };
                *partial = match purpose {
                    Purpose::Explicit => dispatch(Explicit(work)),
                    Purpose::Implicit(kind) => dispatch(Implicit(work, kind)),
                };
            },
        );

        // A maximum has no order; NaN, which it would lose, shows in the sums.
        let max_stretch = partials.iter().map(|partial| partial[STRETCH]).fold(0.0, f64::max);
        let [kinetic_energy, elastic_energy, gravitational_energy, px, py, pz, checksum, _] = sum(partials);

        // A position that is not finite may not reach an energy (no spring, no gravity): the checksum
        // is 0 or NaN, and makes the kinetic energy NaN.
        self.diagnostics = Diagnostics {
            kinetic_energy: kinetic_energy + checksum,
            elastic_energy,
            gravitational_energy,
            momentum: [px, py, pz],
            max_stretch,
        };
    }
}

/// Place of the largest stretch among the sums of a block.
const STRETCH: usize = 7;

/// A block, and what is written of it.
struct Block<'a, R: Real> {
    model: &'a Model<R>,
    numbers: &'a StepNumbers<R>,
    number: usize,
    x: &'a [Padded<R>],
    v: &'a [Padded<R>],
    rows: &'a mut [Sixteen<R>],
    inverse: &'a mut [Inverse3],
    tangent: &'a mut [[R; LANES]],
    frozen: &'a Disjoint<'a, [R; LANES]>,
    scratch: &'a mut BlockScratch<R>,
}

struct Explicit<'a, R: Real>(Block<'a, R>);
struct Implicit<'a, R: Real>(Block<'a, R>, PreconditionerKind);

impl<R: Real> WithSimd<R> for Explicit<'_, R> {
    type Output = Partial;

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> Partial {
        self.0.sums::<P, false>(PreconditionerKind::Identity)
    }
}

impl<R: Real> WithSimd<R> for Implicit<'_, R> {
    type Output = Partial;

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> Partial {
        self.0.sums::<P, true>(self.1)
    }
}

impl<R: Real> Block<'_, R> {
    #[inline(always)]
    fn sums<P: Pack<Number = R>, const IMPLICIT: bool>(mut self, kind: PreconditionerKind) -> Partial {
        let springs = &self.model.springs;
        self.rows.fill(Sixteen::default());
        if IMPLICIT {
            self.scratch.diagonal.fill([[0.0; LANES]; 6]);
        }

        let mut fold = SpringSums::<P, IMPLICIT> {
            springs,
            laws: &self.numbers.springs,
            along: &self.numbers.along,
            mirror: P::splat(self.numbers.mirror),
            first_slot: springs.slots(self.number).start,
            tangent: self.tangent,
            rows: self.rows,
            diagonal: &mut self.scratch.diagonal,
            energy: P::Wide::zero(),
            stretch: Stretch::none(),
        };
        springs.fold_block(self.number, [self.x, self.v], &mut self.scratch.records, &mut fold);
        let (energy, stretch) = (fold.energy, fold.stretch);
        // Both ends count a spring.
        let mut elastic = 0.5 * add_lanes(energy.store());
        if !self.model.elements.is_empty() {
            elastic += self.add_elements::<P, IMPLICIT>();
        }

        let mut figures = Figures::<P::Wide>::new(self.numbers);
        for group in 0..self.rows.len() {
            self.finish::<P, IMPLICIT>(group, kind, &mut figures);
        }
        figures.partial(elastic, stretch.greatest())
    }

    /// Adds the elements to the sums of the rows; returns their energy (J).
    #[inline(always)]
    fn add_elements<P: Pack<Number = R>, const IMPLICIT: bool>(&mut self) -> f64 {
        let rows = self.rows.len() * LANES;
        let (mut energy, mut first) = (0.0, 0);
        self.scratch.corners.clear(rows);
        for (elements, numbers) in self.model.elements.iter().zip(&self.numbers.elements) {
            let range = elements.frozen(self.number);
            let frozen: &mut [[R; LANES]] = if IMPLICIT {
                // SAFETY: lists and blocks have ranges of their own.
                unsafe { self.frozen.range(first + range.start..first + range.end) }
            } else {
                &mut []
            };
            let at = BlockOfRows { block: self.number, rows, fields: [self.x, self.v] };
            energy += elements.evaluate::<P, IMPLICIT>(at, numbers, frozen, self.scratch);
            first += elements.frozen_count();
        }

        let BlockScratch { corners, diagonal, .. } = &mut *self.scratch;
        for (group, row) in self.rows.iter_mut().enumerate() {
            let (own, added) = (row.load::<P>(), corners.sixteen::<P>(group));
            row.store(three!(|c| own[c] + added[c]));
            if IMPLICIT {
                corners.add_blocks_to(group, &mut diagonal[group]);
            }
        }
        energy
    }

    /// Adds to the springs of sixteen rows what acts on each particle by itself.
    #[inline(always)]
    fn finish<P: Pack<Number = R>, const IMPLICIT: bool>(
        &mut self,
        group: usize,
        kind: PreconditionerKind,
        figures: &mut Figures<P::Wide>,
    ) {
        let StepNumbers { dt, drag, wind, gravity, .. } = *self.numbers;
        let place = self.number * (self.model.block_size / LANES) + group;
        let lanes = |field: &[R]| P::load(&field.as_chunks::<LANES>().0[place]);
        let x = packs::<P>(&self.x.as_chunks::<LANES>().0[place]);
        let v = packs::<P>(&self.v.as_chunks::<LANES>().0[place]);
        let (m, inv_m) = (lanes(&self.model.m), lanes(&self.model.inv_m));
        figures.add([P::widen3(x), P::widen3(v)], m.where_positive(inv_m).widen());

        let springs = self.rows[group].load::<P>();
        let force = three!(|c| (v[c] - P::splat(wind[c])) * drag);
        if IMPLICIT {
            let h = R::of(dt);
            self.rows[group]
                .store(three!(|c| ((m * gravity[c] - force[c]) * h + springs[c]).where_positive(inv_m)));
            let sums = load_six::<P::Wide>(&self.scratch.diagonal[group]);
            let own = m.widen() + P::Wide::of(dt * drag.to_f64());
            let block = [sums[0] + own, sums[1] + own, sums[2] + own, sums[3], sums[4], sums[5]];
            self.inverse[group] = Inverse3::of_packs(block, kind, inv_m.widen());
        } else {
            let accelerations =
                three!(|c| ((springs[c] - force[c]) * inv_m + P::splat(gravity[c])).where_positive(inv_m));
            self.rows[group].store(accelerations);
        }
    }
}

/// The entries of sixteen diagonal blocks, in lanes.
#[inline(always)]
fn load_six<W: Pack<Number = f64>>(lanes: &[[f64; LANES]; 6]) -> [W; 6] {
    [
        W::load(&lanes[0]),
        W::load(&lanes[1]),
        W::load(&lanes[2]),
        W::load(&lanes[3]),
        W::load(&lanes[4]),
        W::load(&lanes[5]),
    ]
}

/// Sums over the springs of a block.
struct SpringSums<'a, P: Pack, const IMPLICIT: bool> {
    springs: &'a Springs<P::Number>,
    laws: &'a [SpringNumbers<P::Number>],
    along: &'a [[P::Number; LANES]],
    mirror: P,
    first_slot: usize,
    tangent: &'a mut [[P::Number; LANES]],
    rows: &'a mut [Sixteen<P::Number>],
    diagonal: &'a mut [[[f64; LANES]; 6]],
    energy: P::Wide,
    stretch: Stretch<P>,
}

/// Sums of sixteen rows.
#[derive(Clone, Copy)]
struct RowSums<P: Pack> {
    /// Explicit: forces (N). Implicit: h (f + h df/dx v) (N s).
    row: [P; 3],
    diagonal: [P::Wide; 6],
}

impl<P: Pack, const IMPLICIT: bool> Fold<P> for SpringSums<'_, P, IMPLICIT> {
    type Sums = RowSums<P>;

    #[inline(always)]
    fn sums(&self, group: usize) -> RowSums<P> {
        let diagonal = if IMPLICIT { load_six(&self.diagonal[group]) } else { [P::Wide::zero(); 6] };
        RowSums { row: self.rows[group].load(), diagonal }
    }

    #[inline(always)]
    fn add(&mut self, sums: &mut RowSums<P>, slot: usize, d: [P; 3], w: [P; 3]) {
        let pattern = self.springs.pattern_of[slot] as usize;
        let law = &self.laws[pattern];
        let stiffness = P::load(&law.stiffness);
        let spring = Spring::new(d, P::load(&self.springs.rest_lengths[slot]));
        self.energy += spring.energy(stiffness);
        self.stretch.look(&spring);

        if IMPLICIT {
            let (push, elastic) = (P::load(&law.push), P::load(&law.elastic));
            let [across, b] = spring.tangent(elastic, P::load(&law.viscous), self.mirror);
            self.tangent[slot - self.first_slot] = b.store();
            spring.add_block(&mut sums.diagonal, P::load(&self.along[pattern]), b);

            // h f, and h² df/dx v without the damping: b d.v holds the damping of both.
            let pull = spring.pull(w, push, P::zero()) + b * dot(w, d);
            for c in 0..3 {
                sums.row[c] -= pull * d[c] + across * w[c];
            }
        } else {
            let pull = spring.pull(w, stiffness, P::load(&law.damping));
            for c in 0..3 {
                sums.row[c] -= pull * d[c];
            }
        }
    }

    #[inline(always)]
    fn keep(&mut self, group: usize, sums: RowSums<P>) {
        self.rows[group].store(sums.row);
        if IMPLICIT {
            for c in 0..6 {
                self.diagonal[group][c] = sums.diagonal[c].store();
            }
        }
    }
}

/// Sums over the particles of a block, in lanes.
struct Figures<W> {
    gravity: [W; 3],
    kinetic: W,
    gravitational: W,
    momentum: [W; 3],
    checksum: W,
}

impl<W: Pack<Number = f64>> Figures<W> {
    #[inline(always)]
    fn new<R: Real>(numbers: &StepNumbers<R>) -> Self {
        let gravity = array3(&numbers.gravity).map(W::splat);
        let zero = W::zero();
        Self { gravity, kinetic: zero, gravitational: zero, momentum: [zero; 3], checksum: zero }
    }

    /// Adds sixteen particles of these free masses (kg).
    #[inline(always)]
    fn add(&mut self, [x, v]: [[W; 3]; 2], m: W) {
        self.kinetic += W::of(0.5) * m * dot(v, v);
        self.gravitational -= m * dot(self.gravity, x);
        for c in 0..3 {
            self.momentum[c] += m * v[c];
        }
        self.checksum += (x[0] + x[1] + x[2] + v[0] + v[1] + v[2]) * W::zero();
    }

    #[inline(always)]
    fn partial(self, elastic: f64, stretch: f64) -> Partial {
        let total = |lanes: W| add_lanes(lanes.store());
        let [px, py, pz] = self.momentum.map(total);
        let [kinetic, gravitational, checksum] = [self.kinetic, self.gravitational, self.checksum].map(total);
        [kinetic, elastic, gravitational, px, py, pz, checksum, stretch]
    }
}
