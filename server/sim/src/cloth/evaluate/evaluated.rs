//! A state that is evaluated: what is known of it, the numbers that this follows from, and scratch memory for it.

use super::{evaluation::Evaluation, external::External, numbers::StepNumbers};
use crate::{
    cloth::{
        layout::{Model, Scratches, Triangles},
        settings::Purpose,
        state::State,
    },
    math::{LANES, Padded, Real, Sixteen, vec3},
    parallel::{block_count, per_sixteen_mut, size},
};

/// What evaluations leave, and what they need.
#[derive(Clone, Debug, Default)]
pub(crate) struct Evaluated<R: Real> {
    pub(crate) numbers: StepNumbers<R>,
    pub(crate) evaluation: Evaluation<R>,
    /// What the evaluation was made for, where it is that of the state, with these numbers.
    current: Option<Purpose>,
    pub(crate) scratches: Scratches<R>,
}

impl<R: Real> Evaluated<R> {
    /// Makes room for evaluations with a purpose.
    pub(crate) fn size_for(&mut self, model: &Model<R>, purpose: Purpose) {
        let blocks = block_count(model.count, model.block_size);
        // A cloth of few particles has one block, of fewer rows than a block may have.
        let rows = model.block_size.min(model.m.len());
        let elements = if model.elements.is_empty() { 0 } else { rows };
        let triangles = model.triangles.as_ref().map_or(0, Triangles::room);
        self.scratches.size_for(blocks, [rows, elements, triangles], model.room());
        self.evaluation.size_for(model, purpose);
    }

    /// Takes over that the state is not the one that was evaluated, or not with these numbers.
    pub(crate) fn forget(&mut self) {
        self.current = None;
    }

    /// Takes over that the evaluation is that of what a sub-step wrote, for this purpose too.
    pub(crate) fn know(&mut self, purpose: Purpose) {
        self.current = Some(purpose);
    }

    /// Whether the state was evaluated for a purpose.
    pub(crate) fn is_current(&self, purpose: Purpose) -> bool {
        self.current == Some(purpose)
    }

    /// Evaluates a state, with the air there.
    pub(crate) fn evaluate(&mut self, model: &Model<R>, purpose: Purpose, state: &mut State<R>) {
        let Self { evaluation, numbers, scratches, .. } = self;
        let State { x, v, .. } = state;
        evaluation.run_in_air(model, numbers, purpose, [x, v], scratches);
        self.current = Some(purpose);
    }

    /// Evaluates accelerations at positions (m) and velocities (m/s) within a sub-step.
    pub(crate) fn accelerate(&mut self, model: &Model<R>, [x, v]: [&mut [Padded<R>]; 2]) {
        let Self { evaluation, numbers, scratches, .. } = self;
        evaluation.run_in_air(model, numbers, Purpose::Explicit, [x, v], scratches);
    }

    /// Puts the forces (N) on particles of the user in place of those that there were; those on one particle add up. Rows of
    /// other ranks are left alone.
    pub(crate) fn set_forces(&mut self, model: &Model<R>, forces: impl Iterator<Item = (u32, [f64; 3])>) {
        let External { forces: rows, force_sum, .. } = &mut self.numbers.external;
        (*force_sum, self.current) = (0.0, None);
        let mut forces = forces.peekable();
        let groups = forces.peek().map_or(0, |_| Sixteen::<R>::count_for(model.count));
        size(rows, groups);
        model.share.own().each(per_sixteen_mut(rows), |_, rows| rows.fill(Sixteen::default()));
        for (user, force) in forces {
            let (place, force) = (model.place[user as usize] as usize, vec3::<f64>(force));
            *force_sum += force.norm();
            if model.share.has(place) {
                let (group, lane) = (place / LANES, place % LANES);
                let sum = rows[group].get(lane) + force.map(R::of);
                rows[group].set(lane, sum);
            }
        }
    }

    /// Takes over the forces (N) on particles from another evaluation of the same cloth.
    pub(crate) fn take_forces(&mut self, other: &Self) {
        let (own, given) = (&mut self.numbers.external, &other.numbers.external);
        own.forces.clone_from(&given.forces);
        (own.force_sum, self.current) = (given.force_sum, None);
    }

    /// Freezes the air at a state, for iterates.
    pub(crate) fn freeze_air(&mut self, model: &Model<R>, state: &mut State<R>) {
        if model.triangles.is_some() {
            model.share.exchange([&mut state.x, &mut state.v]);
            self.numbers.external.freeze_air(model, [&state.x, &state.v], &self.scratches);
        }
    }
}
