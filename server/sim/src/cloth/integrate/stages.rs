//! The stages that explicit integrators are made of: force, acceleration, velocity, position.

use rayon::prelude::*;

use crate::{
    cloth::{
        forces::add_forces,
        model::Model,
        state::{State, Workspace},
    },
    linalg::pad,
    math::{Real, Vec3},
    report::{Stage, Stopwatch},
};

/// A step in progress.
pub(super) struct Step<'a, R: Real> {
    pub(super) model: &'a Model<R>,
    pub(super) state: &'a mut State<R>,
    pub(super) work: &'a mut Workspace<R>,
    pub(super) watch: &'a mut dyn Stopwatch,
}

impl<R: Real> Step<'_, R> {
    /// Time step (s).
    pub(super) fn dt(&self) -> R {
        R::of(self.work.frozen.dt)
    }

    /// a = (springs + drag) / m + g at x and v, 0 for pins.
    pub(super) fn accelerate(&mut self) {
        self.forces();
        self.divide_by_mass();
    }

    /// f = springs + drag at x and v; leaves both padded in the workspace.
    pub(super) fn forces(&mut self) {
        let (model, Workspace { frozen, padded: [x, v], f, .. }) = (self.model, &mut *self.work);
        pad(&self.state.x, model.block_size, x);
        pad(&self.state.v, model.block_size, v);
        add_forces(model, frozen, [x, v], f);
        self.watch.lap(Stage::Force);
    }

    /// The same at x and the velocity in the workspace's `w`.
    pub(super) fn accelerate_at_w(&mut self) {
        let (model, Workspace { frozen, padded: [x, v], f, w, .. }) = (self.model, &mut *self.work);
        pad(&self.state.x, model.block_size, x);
        pad(w, model.block_size, v);
        add_forces(model, frozen, [x, v], f);
        self.watch.lap(Stage::Force);
        self.divide_by_mass();
    }

    fn divide_by_mass(&mut self) {
        let (block_size, gravity) = (self.model.block_size, self.work.frozen.gravity);
        let inputs = (self.work.f.par_chunks(block_size), self.model.inv_m.par_chunks(block_size));
        self.work.a.par_chunks_mut(block_size).zip(inputs.into_par_iter()).for_each(|(a, (f, inv_m))| {
            for ((a, f), &inv_m) in a.iter_mut().zip(f).zip(inv_m) {
                *a = if inv_m > R::zero() { f * inv_m + gravity } else { Vec3::zeros() };
            }
        });

        self.watch.lap(Stage::Acceleration);
    }

    /// v += h a.
    pub(super) fn kick(&mut self, h: R) {
        add_scaled(&mut self.state.v, &self.work.a, h, self.model.block_size);
        self.watch.lap(Stage::Velocity);
    }

    /// x += h v.
    pub(super) fn drift(&mut self, h: R) {
        add_scaled(&mut self.state.x, &self.state.v, h, self.model.block_size);
        self.watch.lap(Stage::Position);
    }

    /// w = v + h a.
    pub(super) fn predict(&mut self, h: R) {
        let block_size = self.model.block_size;
        let inputs = (self.state.v.par_chunks(block_size), self.work.a.par_chunks(block_size));
        self.work.w.par_chunks_mut(block_size).zip(inputs.into_par_iter()).for_each(|(w, (v, a))| {
            w.iter_mut().zip(v.iter().zip(a)).for_each(|(w, (v, a))| *w = v + a * h);
        });

        self.watch.lap(Stage::Velocity);
    }
}

/// y += h x.
pub(super) fn add_scaled<R: Real>(y: &mut [Vec3<R>], x: &[Vec3<R>], h: R, block_size: usize) {
    (y.par_chunks_mut(block_size), x.par_chunks(block_size))
        .into_par_iter()
        .for_each(|(y, x)| y.iter_mut().zip(x).for_each(|(y, x)| *y += x * h));
}
