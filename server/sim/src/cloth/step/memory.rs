//! The scratch memory of the steps of one cloth, room by room.

use super::attempt::Attempt;
use crate::{
    cloth::{
        contact::Contact,
        evaluate::Evaluated,
        integrate::{Solver, Vectors},
        layout::{Figure, Model},
        settings::{ClothSettings, Purpose},
        state::{State, Turns},
    },
    math::Real,
    report::Work,
};

/// Scratch memory of one cloth under one set of settings: a step allocates nothing after the first two, which make the
/// two or three states that steps take turns in. Each room has its own, and signatures say which of them a function may touch.
#[derive(Clone, Debug, Default)]
pub(crate) struct StepMemory<R: Real> {
    pub(super) turns: Turns<R>,
    /// The state that a step starts from or leads to, evaluated.
    pub(super) evaluated: Evaluated<R>,
    pub(super) solver: Solver<R>,
    pub(super) vectors: Vectors<R>,
    /// Pairs that keep its surfaces apart, in the sub-step that is tried.
    pub(super) contact: Contact<R>,
    pub(super) attempt: Attempt,
}

impl<R: Real> StepMemory<R> {
    /// Makes room for steps with these settings.
    pub(super) fn size_for(&mut self, model: &Model<R>, settings: &ClothSettings) {
        let purpose = if settings.has_iterates() {
            Purpose::Iterate(settings.solver.preconditioner)
        } else {
            Purpose::of(settings)
        };
        self.evaluated.size_for(model, purpose);
        self.vectors.size_for(model, settings);
        if purpose.has_matrix() {
            self.solver.size_for(model);
        }
    }

    /// Begins a step from a state.
    pub(super) fn begin(&mut self, model: &Model<R>, state: &State<R>) {
        self.turns.begin(state, model.figures.iter().flat_map(Figure::rows));
        self.attempt.begin();
        (self.evaluated.evaluation.runs, self.solver.products) = (0, 0);
    }

    /// Begins a sub-step from a state, before its pins are aimed.
    pub(super) fn begin_substep(&mut self, model: &Model<R>, state: &State<R>) {
        self.turns.begin_substep(state, model.figures.iter().flat_map(Figure::rows));
        self.solver.solves = 0;
    }

    /// Forgets what is known of the state, which somebody else changed.
    pub(crate) fn forget(&mut self) {
        self.evaluated.forget();
        self.solver.forget();
    }

    /// Gives a sub-step up that was not accepted: what it wrote is not the state.
    pub(super) fn abandon(&mut self, state: &mut State<R>) {
        self.turns.abandon(state);
        self.forget();
    }

    /// Takes `state` back to where it was before the step.
    pub(crate) fn undo(&mut self, state: &mut State<R>) {
        self.turns.undo(state);
        self.forget();
    }

    /// The state before the step, once a sub-step was accepted.
    pub(crate) fn before(&self) -> &State<R> {
        self.turns.before()
    }

    /// What the step has cost so far.
    pub(crate) fn work(&self) -> Work {
        Work { force_evaluations: self.evaluated.evaluation.runs, matrix_products: self.solver.products }
    }

    /// The largest error (m) of the sub-step that was tried last.
    pub(crate) fn tried_error(&self) -> f64 {
        self.attempt.tried.error.largest
    }

    /// Bytes that pairs of surfaces take.
    pub(crate) fn pair_bytes(&self) -> usize {
        self.contact.bytes()
    }

    /// Lets pairs of surfaces take so many bytes from now on.
    pub(crate) fn limit_pairs(&mut self, bytes: u64) {
        self.contact.limit(bytes);
    }

    /// Puts the forces (N) on particles of the user in place of those that there were; those on one particle add up. Rows of
    /// other ranks are left alone.
    pub(crate) fn set_forces(&mut self, model: &Model<R>, forces: impl Iterator<Item = (u32, [f64; 3])>) {
        self.evaluated.set_forces(model, forces);
    }
}
