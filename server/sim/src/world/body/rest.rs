//! How still a cloth of a world lies, looked at after each of its steps.

use super::cloth::Cloth;
use crate::{math::Real, report::RestReport};

impl<R: Real> Cloth<R> {
    /// Takes in a step of the world of `dt` (s); tells how much of it lies still, where it is watched.
    pub(crate) fn look_at_rest(&mut self, dt: f64) -> Option<RestReport> {
        let Self { watch, model, settings, state, .. } = self;
        Some(watch.as_mut()?.look(model, settings.rest?, &state.x, dt))
    }

    /// Begins to watch it anew, where it is.
    pub(crate) fn watch_anew(&mut self) {
        if let Some(watch) = &mut self.watch {
            watch.begin(&self.state.x);
        }
    }
}
