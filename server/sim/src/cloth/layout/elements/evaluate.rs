//! Elements evaluated: what they add to the rows of a block, to its diagonal blocks and to its bounds, and what is frozen of them.

use super::{
    Packs,
    numbers::{BlockOfRows, ElementFigures, ElementNumbers},
};
use crate::{
    cloth::{
        laws::{Beyond, ElementLaw, Evaluated, Treatment},
        layout::{halo::behind, scratch::BlockScratch},
        settings::{Aim, RightHandSide},
    },
    math::{LANES, Pack, Real, array::dot, three},
};

impl<R: Real, const N: usize, const C: usize> Packs<R, N, C> {
    /// Adds gradients, tangents and diagonal blocks of a block's elements to the sums of its rows; freezes tangents, with
    /// their negative parts multiplied by `mirror`, and adds to the bounds of an explicit step. Energy and power are those of
    /// the elements whose first particle is the block's.
    #[inline(always)]
    pub(super) fn evaluate<L: ElementLaw<N, C, F>, P: Pack<Number = R>, const F: usize, A: Aim>(
        &self,
        at: BlockOfRows<'_, R>,
        numbers: &ElementNumbers<R>,
        (side, mirror): (RightHandSide, R),
        frozen: &mut [[R; LANES]],
        scratch: &mut BlockScratch<R>,
    ) -> ElementFigures {
        let is_step = side != RightHandSide::Forces;
        let of_velocity = if is_step { numbers.matrix } else { numbers.velocity };
        let treatment = Treatment { mirror: P::splat(mirror), elastic: P::splat(numbers.elastic) };
        assert!(scratch.records.len() >= self.lists.room(), "room for a block and its halo");
        let (first, mut energy, mut power) = (self.lists.packs(at.block).start, 0.0, 0.0);
        let mut longest = P::zero();
        for (halo, packs) in self.lists.halos.parts(at.block) {
            halo.copy(behind(&mut scratch.records, self.lists.block_size), at.fields);
            for pack in packs.filter(|&pack| at.group.is_none_or(|group| self.lists.touches(pack, group))) {
                let (rest, x, v) = self.gather::<P>(pack, &scratch.records);
                let evaluated = L::evaluate(rest, x, treatment);
                let tangent = evaluated.frozen;
                let of_v = of_velocities::<L, P, N, C, F>((rest, x), side, treatment, tangent);
                let push = L::product(rest, of_v, v);
                longest = longest.max(evaluated.stretch);
                let [of_lanes, rates] = figures(&evaluated, side, push, v);
                for (lane, name) in self.lists.names(pack, 0).iter().enumerate() {
                    if usize::from(*name) < at.rows {
                        energy += of_lanes[lane];
                        power -= rates[lane];
                    }
                }
                for corner in 0..N {
                    let (of_x, of_v) = (evaluated.gradient[corner], push[corner]);
                    let row = three!(|c| P::zero() - (of_x[c] * numbers.gradient + of_v[c] * of_velocity));
                    scratch.corners.add(self.lists.names(pack, corner), row);
                }
                if A::HAS_MATRIX {
                    self.add_diagonal::<L, P, F>(pack, (rest, tangent), numbers, scratch);
                }
                if A::IS_BOUNDED && F > 0 {
                    self.add_bounds::<L, P, F>((pack, at.rows), (rest, x, v), numbers, scratch);
                }
                if A::FREEZES {
                    for f in 0..F {
                        frozen[(pack - first) * F + f] = tangent[f].store();
                    }
                }
            }
        }
        let scale = if is_step { numbers.gradient.to_f64() } else { -0.5 * numbers.velocity.to_f64() };
        let stretch = longest.widen().store().into_iter().fold(0.0, f64::max);
        ElementFigures { energy: energy * numbers.energy, power: power * scale, stretch }
    }

    /// Adds the diagonal blocks of a pack's elements to the sums of the rows.
    #[inline(always)]
    fn add_diagonal<L: ElementLaw<N, C, F>, P: Pack<Number = R>, const F: usize>(
        &self,
        pack: usize,
        (rest, tangent): ([P; C], [P; F]),
        numbers: &ElementNumbers<R>,
        scratch: &mut BlockScratch<R>,
    ) {
        let blocks = L::diagonal(rest, tangent);
        for corner in 0..N {
            let mut scaled = [P::Wide::zero(); 6];
            for c in 0..6 {
                scaled[c] = blocks[corner][c].widen() * numbers.matrix.to_f64();
            }
            scratch.corners.add_blocks(self.lists.names(pack, corner), scaled);
        }
    }

    /// Adds to stiffness and damping of the rows what they have beyond those at rest, and looks at the rates at which elements
    /// change.
    #[inline(always)]
    fn add_bounds<L: ElementLaw<N, C, F>, P: Pack<Number = R>, const F: usize>(
        &self,
        (pack, rows): (usize, usize),
        (rest, x, v): ([P; C], [[P; 3]; N], [[P; 3]; N]),
        numbers: &ElementNumbers<R>,
        scratch: &mut BlockScratch<R>,
    ) {
        let (Beyond { all, loads }, rate) = (L::beyond(rest, x), L::rate(rest, v).store());
        let [of_all, of_loads] = numbers.bounded;
        // The bound takes twice the largest eigenvalue of these sums.
        let half = P::of(0.5);
        for corner in 0..N {
            let stiffness = (half * (all[corner] * of_all + loads[corner] * of_loads)).store();
            let damping = (half * all[corner] * numbers.velocity).store();
            for (lane, name) in self.lists.names(pack, corner).iter().enumerate() {
                let row = usize::from(*name);
                if row >= rows {
                    continue;
                }
                let [k, c] = &mut scratch.bounds[row / LANES];
                for axis in 0..3 {
                    k[axis][row % LANES] += stiffness[lane];
                    c[axis][row % LANES] += damping[lane];
                }
                let greatest = &mut scratch.rates[row / LANES][row % LANES];
                if rate[lane] > *greatest {
                    *greatest = rate[lane];
                }
            }
        }
    }

    /// Freezes the tangents of a block's elements alone, with their negative parts multiplied by `mirror`.
    #[inline(always)]
    pub(super) fn freeze<L: ElementLaw<N, C, F>, P: Pack<Number = R>, const F: usize>(
        &self,
        at: BlockOfRows<'_, R>,
        numbers: &ElementNumbers<R>,
        mirror: R,
        frozen: &mut [[R; LANES]],
        scratch: &mut BlockScratch<R>,
    ) {
        let treatment = Treatment { mirror: P::splat(mirror), elastic: P::splat(numbers.elastic) };
        assert!(scratch.records.len() >= self.lists.room(), "room for a block and its halo");
        let first = self.lists.packs(at.block).start;
        for (halo, packs) in self.lists.halos.parts(at.block) {
            halo.copy(behind(&mut scratch.records, self.lists.block_size), at.fields);
            for pack in packs {
                let (rest, x, _) = self.gather::<P>(pack, &scratch.records);
                let tangent = L::evaluate(rest, x, treatment).frozen;
                for f in 0..F {
                    frozen[(pack - first) * F + f] = tangent[f].store();
                }
            }
        }
    }
}

/// What is frozen of H for the part of a row that velocities have: in a step from the state that of the matrix, or the exact
/// one; in a force what damps alone.
#[inline(always)]
fn of_velocities<L: ElementLaw<N, C, F>, P: Pack, const N: usize, const C: usize, const F: usize>(
    (rest, x): ([P; C], [[P; 3]; N]),
    side: RightHandSide,
    treatment: Treatment<P>,
    tangent: [P; F],
) -> [P; F] {
    if F == 0 {
        return tangent;
    }
    let treatment = match side {
        RightHandSide::Step => return tangent,
        RightHandSide::ExactStep => Treatment { mirror: P::one(), ..treatment },
        RightHandSide::Forces => Treatment { elastic: P::zero(), ..treatment },
    };
    L::evaluate(rest, x, treatment).frozen
}

/// Energies of sixteen elements, and the products of their velocities with their gradients, or with what damps them.
#[inline(always)]
fn figures<P: Pack, const N: usize, const F: usize>(
    evaluated: &Evaluated<P, N, F>,
    side: RightHandSide,
    push: [[P; 3]; N],
    v: [[P; 3]; N],
) -> [[f64; LANES]; 2] {
    let (is_step, mut rate) = (side != RightHandSide::Forces, P::Wide::zero());
    for corner in 0..N {
        let along = if is_step { evaluated.gradient[corner] } else { push[corner] };
        rate += dot(along, v[corner]).widen();
    }
    [evaluated.energy.store(), rate.store()]
}
