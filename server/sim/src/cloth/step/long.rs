//! A long step: one sub-step over many steps of the scene, of a cloth that sleeps.

use super::stepping::Stepping;
use crate::{
    cloth::state::ClothReport,
    math::Real,
    report::{StepFailure, Stopwatch},
    sub_step::SubStep,
};

impl<R: Real> Stepping<'_, R> {
    /// Takes a sub-step as long as the surroundings say, whole, and judges where it leads. After a failure the state is to be undone.
    pub(crate) fn step_long(
        &mut self,
        sub_step: SubStep,
        watch: &mut dyn Stopwatch,
    ) -> Result<ClothReport, StepFailure> {
        self.begin();
        self.begin_substep();
        self.attempt(sub_step, watch)?;
        self.settle(watch)?;
        self.finish(watch)
    }
}
