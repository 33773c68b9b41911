//! What integrators are made of: new velocities and positions from accelerations, and accelerations in between.

use crate::{
    cloth::{
        evaluate::{Moved, MovedSums, Weights, Workspace},
        layout::Model,
        settings::Purpose,
        state::State,
    },
    linalg::{packs, store_padded},
    math::{LANES, Pack, Padded, Real, Sixteen, WithSimd, dispatch, three},
    parallel::{per_block_mut, per_row, per_row_mut, per_sixteen},
    report::{Stage, Stopwatch},
};

/// A step in progress.
pub(super) struct Step<'a, R: Real> {
    pub(super) model: &'a Model<R>,
    /// Where it starts.
    pub(super) state: &'a State<R>,
    /// With the evaluation of `state`, and the room for what comes next.
    pub(super) work: &'a mut Workspace<R>,
    pub(super) watch: &'a mut dyn Stopwatch,
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
        R::of(self.work.numbers.dt)
    }

    /// What the error of a particle is of the accelerations that move it by a method of order 1: h² a / 2 is the leading
    /// term of that of x' in one step (s²).
    pub(super) fn error_of_accelerations(&self) -> f64 {
        0.5 * self.work.numbers.dt * self.work.numbers.dt
    }

    /// The same of a change of velocity: h dv / 2 (s).
    pub(super) fn error_of_change(&self) -> f64 {
        0.5 * self.work.numbers.dt
    }

    /// The same of what the second of two kicks adds beyond the first, h (a' - a) / 2: h² (a' - a) / 6 (s).
    pub(super) fn error_of_kicks(&self) -> f64 {
        self.work.numbers.dt / 3.0
    }

    /// v' = v + h a, x' = x + dt v or x + dt v', from the accelerations of the evaluation.
    pub(super) fn kick_and_drift(&mut self, h: R, by: MovedBy) {
        let dt = self.dt();
        let Workspace { evaluation, next, moved, .. } = &mut *self.work;
        // Of explicit Euler, what it adds to a fall is told apart: |a|² m / 2 is summed.
        let wind = (by == MovedBy::Old).then_some([0.0; 3]);
        let change = Change { a: &evaluation.rows, h, dt, by, wind };
        write_next(self.model, self.state, next, &change, moved);
        self.watch.lap(Stage::Position);
    }

    /// Accelerations at the new positions and velocities.
    pub(super) fn accelerate(&mut self) {
        let Workspace { evaluation, numbers, next, scratches, .. } = &mut *self.work;
        evaluation.run(self.model, numbers, Purpose::Explicit, [&mut next.x, &mut next.v], scratches);
        self.watch.lap(Stage::Force);
    }

    /// Accelerations at the new positions, and at the new velocities after h a more.
    pub(super) fn accelerate_ahead(&mut self, h: R) {
        let Workspace { evaluation, numbers, next, predicted, scratches, .. } = &mut *self.work;
        kick_into(self.model, &next.v, &evaluation.rows, h, predicted);
        self.watch.lap(Stage::Position);
        evaluation.run(self.model, numbers, Purpose::Explicit, [&mut next.x, predicted], scratches);
        self.watch.lap(Stage::Force);
    }

    /// v' += h a, the second of two kicks: what it adds beyond the first one is what the error is proportional to.
    pub(super) fn kick_again(&mut self, h: R) {
        let Workspace { evaluation, next, moved, .. } = &mut *self.work;
        let fields = (per_row(&self.state.v), per_row_mut(&mut next.v), per_sixteen(&evaluation.rows));
        self.model.share.own().each((per_block_mut(moved), fields), |_, (moved, (from, v, a))| {
            *moved = dispatch(SecondKick { from, v, a, h });
        });
        self.watch.lap(Stage::Position);
    }
}

/// A change of velocity, and how it moves particles.
pub(super) struct Change<'a, R> {
    /// Accelerations (m/s²), or changes of velocity (m/s) with h = 1.
    pub(super) a: &'a [Sixteen<R>],
    pub(super) h: R,
    /// Time step (s).
    pub(super) dt: R,
    pub(super) by: MovedBy,
    /// Velocity of the medium (m/s), where the step is to be judged by what it changes.
    pub(super) wind: Option<[f64; 3]>,
}

/// Writes positions and velocities one step after `from`; of each block, what `a` adds up to.
pub(super) fn write_next<R: Real>(
    model: &Model<R>,
    from: &State<R>,
    to: &mut State<R>,
    change: &Change<'_, R>,
    moved: &mut [Moved],
) {
    let &Change { a, h, dt, by, wind } = change;
    let sources = ([per_row(&from.x), per_row(&from.v)], per_sixteen(a));
    let targets = [per_row_mut(&mut to.x), per_row_mut(&mut to.v)];
    let masses = [per_row(&model.m), per_row(&model.inv_m)];
    let fields = (per_block_mut(moved), sources, targets, masses);
    model.share.own().each(fields, |_, (moved, (from, a), to, [m, inv_m])| {
        let weights = wind.map(|wind| Weights { m, inv_m, wind });
        let change = Change { a, h, dt, by, wind };
        *moved = dispatch(Advance { from, to, change, weights });
    });
}

struct Advance<'a, R> {
    from: [&'a [Padded<R>]; 2],
    to: [&'a mut [Padded<R>]; 2],
    change: Change<'a, R>,
    weights: Option<Weights<'a, R>>,
}

impl<R: Real> WithSimd<R> for Advance<'_, R> {
    type Output = Moved;

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> Moved {
        let mut sums = MovedSums::<P::Wide>::none();
        let Change { a, h, dt, by, .. } = self.change;
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
            sums.add_error(wide);
            if let Some(weights) = &self.weights {
                sums.add_weighed::<P>(group, weights, [wide, P::widen3(new)]);
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

struct Kick<'a, R> {
    v: &'a mut [Padded<R>],
    a: &'a [Sixteen<R>],
    h: R,
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
struct SecondKick<'a, R> {
    from: &'a [Padded<R>],
    v: &'a mut [Padded<R>],
    a: &'a [Sixteen<R>],
    h: R,
}

impl<R: Real> WithSimd<R> for SecondKick<'_, R> {
    type Output = Moved;

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> Moved {
        let mut sums = MovedSums::<P::Wide>::none();
        let vectors = self.v.as_chunks_mut::<LANES>().0.iter_mut().zip(self.from.as_chunks::<LANES>().0);
        for ((v, from), a) in vectors.zip(self.a) {
            let (old, from, a) = (packs::<P>(v), packs::<P>(from), a.load::<P>());
            let kick = three!(|c| a[c] * self.h);
            store_padded(three!(|c| old[c] + kick[c]), v);
            sums.add_error(P::widen3(three!(|c| kick[c] - (old[c] - from[c]))));
        }
        sums.block()
    }
}
