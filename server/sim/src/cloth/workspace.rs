//! The scratch memory of a step.

use super::{
    evaluation::{Evaluation, Purpose},
    integrator::Integrator,
    model::Model,
    numbers::StepNumbers,
    scratch::Scratches,
    settings::ClothSettings,
    state::{PinMotion, State},
};
use crate::{
    linalg::{BlockCsr, CgWorkspace, CoarseMatrix},
    math::{Padded, Real},
    parallel::block_count,
};

/// Scratch memory of one cloth under one set of settings: a step allocates nothing after the first two, which make the
/// two or three states that steps take turns in.
#[derive(Clone, Debug, Default)]
pub struct Workspace<R: Real> {
    /// The state before the step, to return to; but for pins on their way.
    before: State<R>,
    /// What a sub-step writes.
    pub(super) next: State<R>,
    /// Whether `before` is the state before the step.
    has_moved: bool,
    /// Pins on their way before the step, and their velocities.
    motions: Vec<PinMotion>,
    pin_velocities: Vec<Padded<R>>,
    pub(super) numbers: StepNumbers<R>,
    pub(super) evaluation: Evaluation<R>,
    /// What the evaluation was made for, where it is that of the state, with these numbers.
    current: Option<Purpose>,
    /// Velocities (m/s) that a force is predicted at; of explicit steps alone.
    pub(super) predicted: Vec<Padded<R>>,
    /// The matrix of an implicit step, where the solver asks for an assembled one.
    pub(super) assembled: Option<BlockCsr<R>>,
    /// Of a preconditioner that has a coarse space.
    pub(super) coarse: CoarseMatrix,
    pub(super) cg: CgWorkspace<R>,
    pub(super) scratches: Scratches<R>,
}

impl<R: Real> Workspace<R> {
    /// Empty: the first step sizes it for its method.
    pub fn new() -> Self {
        Self::default()
    }

    /// Forgets what is known of the state, which somebody else changed.
    pub(crate) fn forget(&mut self) {
        self.current = None;
    }

    /// Whether the state was evaluated for a purpose.
    pub(super) fn is_current(&self, purpose: Purpose) -> bool {
        self.current == Some(purpose)
    }

    pub(super) fn size_for(&mut self, model: &Model<R>, settings: &ClothSettings, purpose: Purpose) {
        let blocks = block_count(model.count, model.block_size);
        let elements = if model.elements.is_empty() { 0 } else { model.block_size };
        self.scratches.size_for(blocks, [model.block_size, elements], model.room());
        self.evaluation.size_for(model, purpose);
        if settings.integrator == Integrator::VelocityVerletPredicted {
            self.predicted.resize(model.m.len(), Padded::default());
        }
        if matches!(purpose, Purpose::Implicit(_)) && self.evaluation.rows.len() != self.cg.len() {
            self.cg = CgWorkspace::new(model.count, model.block_size);
        }
    }

    /// Begins a step from a state.
    pub(super) fn begin(&mut self, state: &State<R>) {
        self.has_moved = false;
        self.motions.clone_from(&state.motions);
        self.pin_velocities.clear();
        self.pin_velocities.extend(state.motions.iter().map(|motion| state.v[motion.particle as usize]));
    }

    /// Makes room for what a sub-step from `state` writes, without touching what `undo` needs; of two states where
    /// the step is not divided, of three otherwise.
    pub(super) fn make_room(&mut self, state: &State<R>, substeps: u32) {
        if substeps == 1 {
            std::mem::swap(&mut self.before, &mut self.next);
        }
        self.next.succeed(state);
    }

    /// Ends a sub-step: what it wrote is the state.
    pub(super) fn accept(&mut self, state: &mut State<R>) {
        std::mem::swap(state, &mut self.next);
        if !self.has_moved {
            std::mem::swap(&mut self.before, &mut self.next);
            self.has_moved = true;
        }
    }

    /// Takes `state` back to where it was before the step.
    pub(crate) fn undo(&mut self, state: &mut State<R>) {
        if self.has_moved {
            std::mem::swap(state, &mut self.before);
            self.has_moved = false;
        }
        state.motions.clone_from(&self.motions);
        for (motion, v) in self.motions.iter().zip(&self.pin_velocities) {
            state.v[motion.particle as usize] = *v;
        }
        self.forget();
    }

    /// Evaluates a state.
    pub(super) fn evaluate(&mut self, model: &Model<R>, purpose: Purpose, state: &State<R>) {
        self.evaluation.run(model, &self.numbers, purpose, [&state.x, &state.v], &self.scratches);
        self.current = Some(purpose);
    }
}
