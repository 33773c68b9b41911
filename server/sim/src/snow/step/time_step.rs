//! A step of the world in steps of the snow: as few equal ones as the certified bound allows.
//!
//! Reads the bound after each step; writes how long the next one is.

use super::failure::{MOVE, check_time_step, culprits, node_failure};
use crate::{
    math::Real,
    report::StepFailure,
    snow::{
        model::SnowModel,
        state::{SnowState, SnowWorkspace},
        transfer::StepContext,
    },
    sub_step::SubStep,
    surroundings::Surroundings,
    time_step::TimeStep,
};

/// How far a step of the world has come.
pub(crate) struct Division<'a> {
    around: &'a Surroundings<'a>,
    /// What is left of the world's step (s).
    left: f64,
    /// Steps of the snow, those that were taken again among them.
    pub(crate) substeps: u32,
    /// Length of the last of them (s).
    pub(crate) dt: f64,
    /// Equal steps that are left, this one among them.
    steps: f64,
}

impl<'a> Division<'a> {
    /// Nothing done yet.
    pub(crate) fn of(around: &'a Surroundings<'a>) -> Self {
        Self { around, left: around.dt, substeps: 0, dt: 0.0, steps: 0.0 }
    }

    /// Whether the world's step is done.
    pub(crate) fn is_done(&self) -> bool {
        self.left <= 0.0
    }

    /// Whether the step at hand is the last one.
    pub(crate) fn is_last(&self) -> bool {
        self.steps <= 1.0
    }

    /// The next step of the snow.
    pub(crate) fn next<R: Real>(
        &mut self,
        model: &SnowModel<R>,
        state: &mut SnowState<R>,
        work: &SnowWorkspace<R>,
    ) -> Result<StepContext<'a>, StepFailure> {
        let Surroundings { gravity, wind, colliders, time, dt, interrupt, .. } = *self.around;
        if interrupt.is_requested() {
            return Err(StepFailure::Interrupted);
        }

        let (kind, bound) = check_time_step(model, state, work, colliders, [time, time + dt])?;
        let (allowed, held) = match model.settings.time_step {
            TimeStep::Certified { safety } => {
                let allowed = safety * bound;
                (allowed, state.hold.length(dt, allowed))
            }
            TimeStep::Fixed(dt) | TimeStep::Unchecked(dt) => (dt, dt),
        };

        // What the bound asks for, not what is held since it asked for more.
        let limit = model.settings.max_substeps;
        if f64::from(self.substeps) + TimeStep::divide(self.left, allowed) > f64::from(limit) {
            let particle = culprits(model, state, work).of(kind).unwrap_or_default();
            return Err(StepFailure::Substeps { particle, dt: allowed, limit, bound: kind, law: None });
        }

        self.steps = TimeStep::divide(self.left, held);
        self.dt = self.left / self.steps;
        state.book.note(self.dt / bound);
        let sub_step = SubStep { dt: self.dt, end: time + dt - self.left + self.dt };
        Ok(StepContext { sub_step, gravity, wind, colliders, interrupt })
    }

    /// The step was taken.
    pub(crate) fn go_on(&mut self) {
        self.substeps += 1;
        self.left = if self.is_last() { 0.0 } else { self.left - self.dt };
    }

    /// The step is to be taken again, shorter: a node would have `moved` by too many cells, but nothing
    /// has moved yet. A step that is fixed, or whose numbers are out of range, fails.
    pub(crate) fn retry<R: Real>(
        &mut self,
        model: &SnowModel<R>,
        state: &mut SnowState<R>,
        work: &SnowWorkspace<R>,
        moved: f64,
        node: [i32; 3],
    ) -> Result<(), StepFailure> {
        if !moved.is_finite() || !matches!(model.settings.time_step, TimeStep::Certified { .. }) {
            return Err(node_failure(model, state, work, moved, node));
        }
        state.hold.shorten(self.around.dt, self.dt * 0.5 * MOVE / moved);
        self.substeps += 1;
        Ok(())
    }
}
