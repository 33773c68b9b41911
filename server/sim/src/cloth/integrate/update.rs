//! What integrators are made of: new velocities and positions from accelerations, and accelerations in between.

use rayon::prelude::*;

use crate::{
    cloth::{evaluation::Purpose, model::Model, state::State, workspace::Workspace},
    linalg::{packs, store_padded},
    math::{LANES, Pack, Padded, Real, Sixteen, WithSimd, dispatch, three},
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

    /// v' = v + h a, x' = x + dt v or x + dt v', from the accelerations of the evaluation.
    pub(super) fn kick_and_drift(&mut self, h: R, by: MovedBy) {
        let dt = self.dt();
        let Workspace { evaluation, next, .. } = &mut *self.work;
        write_next(self.model, self.state, next, &Change { a: &evaluation.rows, h, dt, by });
        self.watch.lap(Stage::Position);
    }

    /// Accelerations at the new positions and velocities.
    pub(super) fn accelerate(&mut self) {
        let Workspace { evaluation, numbers, next, scratches, .. } = &mut *self.work;
        evaluation.run(self.model, numbers, Purpose::Explicit, [&next.x, &next.v], scratches);
        self.watch.lap(Stage::Force);
    }

    /// Accelerations at the new positions, and at the new velocities after h a more.
    pub(super) fn accelerate_ahead(&mut self, h: R) {
        let Workspace { evaluation, numbers, next, predicted, scratches, .. } = &mut *self.work;
        kick_into(self.model, &next.v, &evaluation.rows, h, predicted);
        self.watch.lap(Stage::Position);
        evaluation.run(self.model, numbers, Purpose::Explicit, [&next.x, predicted], scratches);
        self.watch.lap(Stage::Force);
    }

    /// v' += h a.
    pub(super) fn kick(&mut self, h: R) {
        let Workspace { evaluation, next, .. } = &mut *self.work;
        let groups = self.model.block_size / LANES;
        (next.v.par_chunks_mut(self.model.block_size), evaluation.rows.par_chunks(groups))
            .into_par_iter()
            .for_each(|(v, a)| dispatch(Kick { v, a, h }));
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
}

/// Writes positions and velocities one step after `from`.
pub(super) fn write_next<R: Real>(
    model: &Model<R>,
    from: &State<R>,
    to: &mut State<R>,
    change: &Change<'_, R>,
) {
    let size = model.block_size;
    let &Change { a, h, dt, by } = change;
    let targets = (to.x.par_chunks_mut(size), to.v.par_chunks_mut(size));
    let sources = (from.x.par_chunks(size), from.v.par_chunks(size), a.par_chunks(size / LANES));
    (targets, sources).into_par_iter().for_each(|((to_x, to_v), (x, v, a))| {
        dispatch(Advance { from: [x, v], to: [to_x, to_v], change: Change { a, h, dt, by } });
    });
}

struct Advance<'a, R> {
    from: [&'a [Padded<R>]; 2],
    to: [&'a mut [Padded<R>]; 2],
    change: Change<'a, R>,
}

impl<R: Real> WithSimd<R> for Advance<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let Change { a, h, dt, by } = self.change;
        let [x, v] = self.from;
        let [to_x, to_v] = self.to;
        let (x, v) = (x.as_chunks::<LANES>().0, v.as_chunks::<LANES>().0);
        let (to_x, to_v) = (to_x.as_chunks_mut::<LANES>().0, to_v.as_chunks_mut::<LANES>().0);
        for (((x, v), a), (to_x, to_v)) in x.iter().zip(v).zip(a).zip(to_x.iter_mut().zip(to_v)) {
            let (x, v, a) = (packs::<P>(x), packs::<P>(v), a.load::<P>());
            let new = three!(|c| v[c] + a[c] * h);
            let moved_by = if by == MovedBy::New { new } else { v };
            store_padded(new, to_v);
            store_padded(three!(|c| x[c] + moved_by[c] * dt), to_x);
        }
    }
}

/// to = v + h a.
fn kick_into<R: Real>(model: &Model<R>, v: &[Padded<R>], a: &[Sixteen<R>], h: R, to: &mut [Padded<R>]) {
    let size = model.block_size;
    (to.par_chunks_mut(size), v.par_chunks(size), a.par_chunks(size / LANES)).into_par_iter().for_each(
        |(to, v, a)| {
            to.copy_from_slice(v);
            dispatch(Kick { v: to, a, h });
        },
    );
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
