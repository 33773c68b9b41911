//! The tasks of a step of a cloth of a world, each by itself, on a copy of it.

use super::cloth::Cloth;
use crate::{math::Real, report::Task, surroundings::Surroundings};

impl<R: Real> Cloth<R> {
    /// Does the tasks of a step on a copy, each by itself, and tells each once it is done.
    pub(crate) fn tasks(&self, around: &Surroundings<'_>, done: &mut dyn FnMut(Task)) {
        let mut copy = self.clone();
        copy.renew_forces(around.time, around.dt);
        copy.stepping(around).tasks(done);
    }
}
