//! What a step does in one sweep over the particles, in three, and its solve by itself: to be timed one by one.

use super::{
    at::At,
    update::{Kick, Step},
};
use crate::{
    cloth::{layout::Model, settings::ClothSettings},
    interrupt::Interrupt,
    linalg::{lanes_at, packs, store_padded},
    math::{LANES, Pack, Padded, Real, Sixteen, WithSimd, dispatch, three},
    parallel::{per_row, per_row_mut, per_sixteen, per_sixteen_mut},
};

/// a = f / m, over the forces; 0 for pins.
pub(crate) fn accelerate<R: Real>(model: &Model<R>, forces: &mut [Sixteen<R>]) {
    model.share.own().each((per_sixteen_mut(forces), per_row(&model.inv_m)), |_, (forces, inv_m)| {
        dispatch(Divide { forces, inv_m });
    });
}

/// v' = v + h a, over the velocities.
pub(crate) fn kick<R: Real>(model: &Model<R>, v: &mut [Padded<R>], a: &[Sixteen<R>], h: R) {
    model.share.own().each((per_row_mut(v), per_sixteen(a)), |_, (v, a)| dispatch(Kick { v, a, h }));
}

/// x' = x + h v, over the positions.
pub(crate) fn drift<R: Real>(model: &Model<R>, x: &mut [Padded<R>], v: &[Padded<R>], h: R) {
    model.share.own().each((per_row_mut(x), per_row(v)), |_, (x, v)| dispatch(Drift { x, v, h }));
}

/// The linear solve from the state, of which the matrix and the right-hand side were evaluated.
pub(crate) fn solve_once<R: Real>(step: &mut Step<'_, R>, settings: &ClothSettings, interrupt: &Interrupt) {
    step.solve(At::State, settings, interrupt);
}

struct Divide<'a, R> {
    forces: &'a mut [Sixteen<R>],
    inv_m: &'a [R],
}

impl<R: Real> WithSimd<R> for Divide<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        for (group, row) in self.forces.iter_mut().enumerate() {
            let (force, inv_m) = (row.load::<P>(), lanes_at::<P>(self.inv_m, group));
            row.store(three!(|c| force[c] * inv_m));
        }
    }
}

struct Drift<'a, R: Real> {
    x: &'a mut [Padded<R>],
    v: &'a [Padded<R>],
    h: R,
}

impl<R: Real> WithSimd<R> for Drift<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let (x, v) = (self.x.as_chunks_mut::<LANES>().0, self.v.as_chunks::<LANES>().0);
        for (x, v) in x.iter_mut().zip(v) {
            let (old, v) = (packs::<P>(x), packs::<P>(v));
            store_padded(three!(|c| old[c] + v[c] * self.h), x);
        }
    }
}
