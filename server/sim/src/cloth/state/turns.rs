//! The states that a step takes turns in: the one before it, to return to, and the one that a sub-step writes.

use super::cloth::{PinMotion, State};
use crate::math::{Padded, Real};

/// Pins on their way, corners of figures, and their velocities, to return to.
#[derive(Clone, Debug, Default)]
struct Pins<R: Real> {
    motions: Vec<PinMotion>,
    velocities: Vec<Padded<R>>,
    /// The row of each corner, with its velocity.
    corners: Vec<(usize, Padded<R>)>,
}

impl<R: Real> Pins<R> {
    /// Keeps those of a state, with the rows of corners.
    fn keep(&mut self, state: &State<R>, corners: impl Iterator<Item = usize>) {
        self.motions.clone_from(&state.motions);
        self.velocities.clear();
        self.velocities.extend(state.motions.iter().map(|motion| state.v[motion.particle as usize]));
        self.corners.clear();
        self.corners.extend(corners.map(|row| (row, state.v[row])));
    }

    fn restore(&self, state: &mut State<R>) {
        state.motions.clone_from(&self.motions);
        for (motion, v) in self.motions.iter().zip(&self.velocities) {
            state.v[motion.particle as usize] = *v;
        }
        for (row, v) in &self.corners {
            state.v[*row] = *v;
        }
    }
}

/// States beside the present one: two in all where no step is divided, three otherwise.
#[derive(Clone, Debug, Default)]
pub(crate) struct Turns<R: Real> {
    /// The state before the step, to return to; but for pins on their way.
    before: State<R>,
    /// What a sub-step writes.
    pub(crate) next: State<R>,
    /// Whether `before` is the state before the step.
    has_moved: bool,
    /// Pins on their way before the step, and before the sub-step.
    pins: Pins<R>,
    pins_of_substep: Pins<R>,
}

impl<R: Real> Turns<R> {
    /// Begins a step from a state, in which corners of figures have these rows.
    pub(crate) fn begin(&mut self, state: &State<R>, corners: impl Iterator<Item = usize>) {
        self.has_moved = false;
        self.pins.keep(state, corners);
    }

    /// Begins a sub-step from a state, before its pins are aimed and its corners are led.
    pub(crate) fn begin_substep(&mut self, state: &State<R>, corners: impl Iterator<Item = usize>) {
        self.pins_of_substep.keep(state, corners);
    }

    /// Makes room for what a sub-step from `state` writes, without touching what `undo` needs; of two states where
    /// the step is not divided, of three otherwise.
    pub(crate) fn make_room(&mut self, state: &State<R>) {
        if !self.has_moved && self.next.x.is_empty() {
            std::mem::swap(&mut self.before, &mut self.next);
        }
        self.next.succeed(state);
        if !state.past.x.is_empty() {
            self.next.size_past();
        }
    }

    /// Gives a sub-step up that was not accepted: what it wrote is not the state.
    pub(crate) fn abandon(&self, state: &mut State<R>) {
        self.pins_of_substep.restore(state);
    }

    /// Ends a sub-step: what it wrote is the state.
    pub(crate) fn accept(&mut self, state: &mut State<R>) {
        std::mem::swap(state, &mut self.next);
        if !self.has_moved {
            std::mem::swap(&mut self.before, &mut self.next);
            self.has_moved = true;
        }
    }

    /// The state before the step, once a sub-step was accepted.
    pub(crate) fn before(&self) -> &State<R> {
        &self.before
    }

    /// Takes `state` back to where it was before the step.
    pub(crate) fn undo(&mut self, state: &mut State<R>) {
        if self.has_moved {
            std::mem::swap(state, &mut self.before);
            self.has_moved = false;
        }
        self.pins.restore(state);
    }
}
