//! What integrators are made of: new velocities and positions from accelerations, and accelerations in between.

use super::{solver::Solver, vectors::Vectors};
use crate::{
    cloth::{
        contact::Contact,
        evaluate::{Common, Evaluated, Motion, Moved, MovedSums, PartSums, StepNumbers, Total, Weights},
        layout::Model,
        state::State,
    },
    collide::Kept,
    linalg::{lanes_at, packs, packs_at, store_padded},
    math::{LANES, Pack, Padded, Real, Sixteen, WithSimd, dispatch, three},
    parallel::{per_block_mut, per_row, per_row_mut, per_sixteen},
    report::{Stage, Stopwatch},
};

/// A step in progress: what it reads, what it writes, and the memory that each part of it has.
pub(crate) struct Step<'a, R: Real> {
    pub(crate) model: &'a Model<R>,
    /// Where it starts, and the sums over that.
    pub(crate) state: &'a State<R>,
    pub(crate) start: &'a Total,
    /// Where it leads.
    pub(crate) next: &'a mut State<R>,
    /// With the evaluation of `state`, which is used up.
    pub(crate) evaluated: &'a mut Evaluated<R>,
    pub(crate) solver: &'a mut Solver<R>,
    pub(crate) vectors: &'a mut Vectors<R>,
    pub(crate) contact: &'a mut Contact<R>,
    /// What meeting colliders keeps.
    pub(crate) contacts: &'a mut Kept,
    /// What parts do as a whole, and memory for that.
    pub(crate) common: &'a mut Common,
    pub(crate) of_parts: &'a mut PartSums,
    pub(crate) watch: &'a mut dyn Stopwatch,
}

/// Which velocity moves particles.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum MovedBy {
    /// That before the step.
    Old,
    /// The new one.
    New,
}

impl<R: Real> Step<'_, R> {
    /// Time step (s).
    pub(super) fn dt(&self) -> R {
        R::of(self.evaluated.numbers.sub_step.dt)
    }

    /// What the error of a particle is of the accelerations that move it by a method of order 1: h² a / 2 is the leading
    /// term of that of x' in one step (s²).
    pub(super) fn error_of_accelerations(&self) -> f64 {
        0.5 * self.evaluated.numbers.sub_step.dt * self.evaluated.numbers.sub_step.dt
    }

    /// The same of a change of velocity: h dv / 2 (s).
    pub(super) fn error_of_change(&self) -> f64 {
        0.5 * self.evaluated.numbers.sub_step.dt
    }

    /// The same of what the second of two kicks adds beyond the first, h (a' - a) / 2: h² (a' - a) / 6 (s).
    pub(super) fn error_of_kicks(&self) -> f64 {
        self.evaluated.numbers.sub_step.dt / 3.0
    }

    /// How far it moves particles: the error of each is `scale` times the length of what its block added up.
    pub(super) fn motion(&self, scale: f64) -> Motion {
        Motion::of(&self.model.share, &self.vectors.moved, self.model.free_count, scale)
    }

    /// v' = v + h a, x' = x + dt v or x + dt v', from the accelerations of the evaluation.
    pub(super) fn kick_and_drift(&mut self, h: R, by: MovedBy) {
        let dt = self.dt();
        let Evaluated { evaluation, numbers, .. } = &*self.evaluated;
        // Of explicit Euler, what it adds to a fall is told apart: |a|² m / 2 is summed.
        let weighed = if by == MovedBy::Old { Weighed::Change } else { Weighed::Nothing };
        let change = Change { a: &evaluation.rows, h, dt, by, weighed, numbers };
        write_next(self.model, self.state, self.next, &change, &mut self.vectors.moved);
        self.watch.lap(Stage::Position);
    }

    /// Accelerations at the new positions and velocities.
    pub(super) fn accelerate(&mut self) {
        let State { x, v, .. } = &mut *self.next;
        self.evaluated.accelerate(self.model, [x, v]);
        self.watch.lap(Stage::Force);
    }

    /// Accelerations at the new positions, and at the new velocities after h a more.
    pub(super) fn accelerate_ahead(&mut self, h: R) {
        let predicted = &mut self.vectors.predicted;
        kick_into(self.model, &self.next.v, &self.evaluated.evaluation.rows, h, predicted);
        self.watch.lap(Stage::Position);
        self.evaluated.accelerate(self.model, [&mut self.next.x, predicted]);
        self.watch.lap(Stage::Force);
    }

    /// v' += h a, the second of two kicks: what it adds beyond the first one is what the error is proportional to. Forces are
    /// those at the velocities after the first kick, or at predicted ones.
    pub(super) fn kick_again(&mut self, h: R) {
        let (model, share) = (self.model, h.to_f64() / self.evaluated.numbers.sub_step.dt);
        let Evaluated { evaluation, numbers, .. } = &*self.evaluated;
        let Vectors { moved, predicted, .. } = &mut *self.vectors;
        let at = (!predicted.is_empty()).then(|| per_row(predicted));
        let fields = (per_row(&self.state.v), per_row_mut(&mut self.next.v), per_sixteen(&evaluation.rows));
        let fields = (per_block_mut(moved), fields, (at, per_row(&model.inv_m)));
        model.share.own().each(fields, |block, (moved, (from, v, a), (at, inv_m))| {
            let first = block * (model.block_size / LANES);
            let kick = dispatch(SecondKick { from, v, a, h, at, inv_m, numbers, first, share });
            *moved = moved.and(kick);
        });
        self.watch.lap(Stage::Position);
    }
}

/// What of a change of velocity is added up, to judge the step by, beside what its error is proportional to.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Weighed {
    /// Nothing: the step is explicit.
    Nothing,
    /// Its square, which explicit Euler adds to a fall.
    Change,
    /// All that an implicit step is judged by.
    All,
}

/// A change of velocity, and how it moves particles.
pub(super) struct Change<'a, R: Real> {
    /// Accelerations (m/s²), or changes of velocity (m/s) with h = 1.
    pub(super) a: &'a [Sixteen<R>],
    pub(super) h: R,
    /// Time step (s).
    pub(super) dt: R,
    pub(super) by: MovedBy,
    pub(super) weighed: Weighed,
    pub(super) numbers: &'a StepNumbers<R>,
}

/// Writes positions and velocities one step after `from`; of each block, what `a` adds up to.
pub(super) fn write_next<R: Real>(
    model: &Model<R>,
    from: &State<R>,
    to: &mut State<R>,
    change: &Change<'_, R>,
    moved: &mut [Moved],
) {
    let &Change { a, h, dt, by, weighed, numbers } = change;
    let sources = ([per_row(&from.x), per_row(&from.v)], per_sixteen(a));
    let targets = [per_row_mut(&mut to.x), per_row_mut(&mut to.v)];
    let masses = [per_row(&model.m), per_row(&model.inv_m)];
    let fields = (per_block_mut(moved), sources, targets, masses);
    model.share.own().each(fields, |block, (moved, (from, a), to, [m, inv_m])| {
        let first = block * (model.block_size / LANES);
        let weights = Weights { m, inv_m, numbers, first };
        let change = Change { a, h, dt, by, weighed, numbers };
        *moved = dispatch(Advance { from, to, change, weights });
    });
}

struct Advance<'a, R: Real> {
    from: [&'a [Padded<R>]; 2],
    to: [&'a mut [Padded<R>]; 2],
    change: Change<'a, R>,
    weights: Weights<'a, R>,
}

impl<R: Real> WithSimd<R> for Advance<'_, R> {
    type Output = Moved;

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> Moved {
        let mut sums = MovedSums::<P::Wide>::none();
        let Change { a, h, dt, by, weighed, numbers } = self.change;
        let share = h.to_f64() / dt.to_f64();
        let [x, v] = self.from;
        let [to_x, to_v] = self.to;
        let (x, v) = (x.as_chunks::<LANES>().0, v.as_chunks::<LANES>().0);
        let (to_x, to_v) = (to_x.as_chunks_mut::<LANES>().0, to_v.as_chunks_mut::<LANES>().0);
        let rows = x.iter().zip(v).zip(a).zip(to_x.iter_mut().zip(to_v)).enumerate();
        for (group, (((x, v), a), (to_x, to_v))) in rows {
            let (x, v, a) = (packs::<P>(x), packs::<P>(v), a.load::<P>());
            let new = three!(|c| v[c] + a[c] * h);
            let moved_by = if by == MovedBy::New { new } else { v };
            store_padded(new, to_v);
            store_padded(three!(|c| x[c] + moved_by[c] * dt), to_x);
            let wide = P::widen3(a);
            let Weights { m, inv_m, first, .. } = self.weights;
            // Corners of figures that give way have no error.
            let free = lanes_at::<P>(inv_m, group).widen();
            sums.add_error(three!(|c| wide[c].where_positive(free)));
            match weighed {
                Weighed::All => sums.add_weighed::<P>(group, &self.weights, [wide, P::widen3(new)]),
                Weighed::Change => sums.add_change(lanes_at::<P>(m, group).widen(), wide),
                Weighed::Nothing => {}
            }
            if weighed != Weighed::All {
                let inv_m = lanes_at::<P>(inv_m, group);
                let accounted = if weighed == Weighed::Change { v } else { new };
                sums.add_kick((numbers, first + group), v, [v, new, accounted], (inv_m, share));
            }
        }
        sums.block()
    }
}

/// to = v + h a.
fn kick_into<R: Real>(model: &Model<R>, v: &[Padded<R>], a: &[Sixteen<R>], h: R, to: &mut [Padded<R>]) {
    model.share.own().each((per_row_mut(to), per_row(v), per_sixteen(a)), |_, (to, v, a)| {
        to.copy_from_slice(v);
        dispatch(Kick { v: to, a, h });
    });
}

/// v' = v + h a.
pub(super) struct Kick<'a, R> {
    pub(super) v: &'a mut [Padded<R>],
    pub(super) a: &'a [Sixteen<R>],
    pub(super) h: R,
}

impl<R: Real> WithSimd<R> for Kick<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        for (v, a) in self.v.as_chunks_mut::<LANES>().0.iter_mut().zip(self.a) {
            let (old, a) = (packs::<P>(v), a.load::<P>());
            store_padded(three!(|c| old[c] + a[c] * self.h), v);
        }
    }
}

/// v' = v + h a, and how much that is beyond what the first kick added to `from`.
struct SecondKick<'a, R: Real> {
    from: &'a [Padded<R>],
    v: &'a mut [Padded<R>],
    a: &'a [Sixteen<R>],
    h: R,
    /// Velocities at which forces were evaluated, where they are others than those before the kick.
    at: Option<&'a [Padded<R>]>,
    inv_m: &'a [R],
    numbers: &'a StepNumbers<R>,
    /// Which group of sixteen the block begins with.
    first: usize,
    /// Length of the kick over that of the sub-step.
    share: f64,
}

impl<R: Real> WithSimd<R> for SecondKick<'_, R> {
    type Output = Moved;

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> Moved {
        let mut sums = MovedSums::<P::Wide>::none();
        let vectors = self.v.as_chunks_mut::<LANES>().0.iter_mut().zip(self.from.as_chunks::<LANES>().0);
        for (group, ((v, from), a)) in vectors.zip(self.a).enumerate() {
            let (old, from, a) = (packs::<P>(v), packs::<P>(from), a.load::<P>());
            let kick = three!(|c| a[c] * self.h);
            let new = three!(|c| old[c] + kick[c]);
            store_padded(new, v);
            let at = match self.at {
                Some(at) => packs_at::<P>(at, group),
                None => old,
            };
            let inv_m = lanes_at::<P>(self.inv_m, group);
            sums.add_kick((self.numbers, self.first + group), at, [old, new, new], (inv_m, self.share));
            sums.add_error(P::widen3(three!(|c| kick[c] - (old[c] - from[c]))));
        }
        sums.block()
    }
}
