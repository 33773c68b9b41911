//! What calls do to a cloth beside its parameters: forces on particles, another state, its start again.

use super::{cloth::Cloth, forces::Forces};
use crate::{
    cloth::State,
    math::{Padded, Real},
};

impl<R: Real> Cloth<R> {
    /// Sets forces on particles, on all free ones where there are none.
    pub(super) fn set_forces(&mut self, particles: &[u32], forces: &Forces) {
        let Self { acting, model, .. } = self;
        let is_pinned = |particle: u32| model.inv_m[model.place[particle as usize] as usize] == R::zero();
        acting.set(particles, forces, model.count, is_pinned);
    }

    /// Takes over the forces in a step of the world from a time (s) on, of `dt` (s), where they are others than before.
    pub(super) fn renew_forces(&mut self, time: f64, dt: f64) {
        if !self.acting.is_new(time, dt) {
            return;
        }
        let Self { acting, model, work, .. } = self;
        work.set_forces(model, acting.now(time, dt));
        // Changes of calls have done so.
        if self.acting.has_changed(time, dt) {
            self.forget_past();
        }
    }

    /// Puts its particles elsewhere (m), with these velocities (m/s); pins stand.
    pub(super) fn place(&mut self, positions: &[[f64; 3]], velocities: Option<&[[f64; 3]]>) {
        let x = self.model.arrange(positions);
        let still = || vec![Padded::default(); x.len()];
        let v = velocities.map_or_else(still, |velocities| self.model.arrange(velocities));
        self.begin_from([x, v]);
    }

    /// Puts it back to its start.
    pub(super) fn reset(&mut self) {
        let start = self.start.clone();
        let (fields, parameters) = &*start;
        self.parameters.clone_from(parameters);
        self.acting.put(Vec::new());
        self.begin_from(fields.clone());
    }

    /// Goes on from positions (m) and velocities (m/s) alone, in the model's order.
    fn begin_from(&mut self, [x, v]: [Vec<Padded<R>>; 2]) {
        self.state = State { x, v, ..State::default() };
        self.sent.clear();
        self.still_pins();
        self.work.forget();
    }
}
