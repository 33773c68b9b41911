//! Vectors of a sub-step that is tried, beside its states, and what is added up over their blocks.

use crate::{
    cloth::{
        evaluate::{Leftover, Moved, Shift, SweepSums},
        layout::Model,
        settings::{ClothSettings, Integrator},
    },
    math::{Padded, Real, Vec3},
    parallel::{block_count, size},
};

/// What integrators work with. Each is made for the methods that use it, and empty for others.
#[derive(Clone, Debug, Default)]
pub(crate) struct Vectors<R: Real> {
    /// What the sub-step found of its motion, block by block.
    pub(super) moved: Vec<Moved>,
    /// Of steps with a matrix, block by block: inertia where the step starts (J), what is left over at an iterate, the momentum
    /// (N s) that forces give to what no pin holds, and B (N s/m) of the air there.
    pub(super) inertias: Vec<f64>,
    pub(super) leftovers: Vec<Leftover>,
    pub(super) momenta: Vec<[f64; 9]>,
    /// On the way out of a saddle, block by block: the greatest square of a change of velocity (m²/s²).
    pub(super) squares: Vec<f64>,
    /// Of sweeps, block by block: where the last one led.
    pub(super) sweep_sums: Vec<SweepSums>,
    /// Velocities (m/s) that a force is predicted at; of explicit steps alone.
    pub(super) predicted: Vec<Padded<R>>,
    /// Positions (m) and velocities (m/s) of an iterate that is tried.
    pub(super) trial: [Vec<Padded<R>>; 2],
    /// Of sweeps: velocities (m/s) that the last one began with, and those that the one before it ended with.
    pub(super) swept: [Vec<Padded<R>>; 2],
    /// By how much each component, of sweeps, or each part moves as a whole (m/s).
    pub(super) shifts: Vec<Vec3<R>>,
    /// What each part lacks of the momentum that it should have.
    pub(super) lacking: Vec<Shift>,
}

impl<R: Real> Vectors<R> {
    /// Makes room for what steps with these settings use.
    pub(crate) fn size_for(&mut self, model: &Model<R>, settings: &ClothSettings) {
        let (blocks, rows) = (block_count(model.count, model.block_size), model.m.len());
        self.moved.resize(blocks, Moved::default());
        if settings.integrator.is_implicit() {
            self.inertias.resize(blocks, 0.0);
            self.leftovers.resize(blocks, Leftover::default());
            self.momenta.resize(blocks, [0.0; 9]);
            self.squares.resize(blocks, 0.0);
        }
        if settings.integrator == Integrator::VelocityVerletPredicted {
            size(&mut self.predicted, rows);
        }
        if settings.has_iterates() {
            self.trial.iter_mut().for_each(|field| size(field, rows));
        }
        if settings.has_sweeps() {
            self.sweep_sums.resize(blocks, SweepSums::default());
            self.swept.iter_mut().for_each(|field| size(field, rows));
        }
    }
}
