//! How long the steps are that a bound allows: held, so that their length does not follow the motion.
//!
//! Enters: before each step, what its bound allows. Leaves: how long it is, an equal part of the step of the world.
//!
//! A symplectic step of fixed length keeps an energy of its own, near the true one; one of another length keeps another
//! (Skeel and Gear 1992, "Does variable step size ruin a symplectic integrator?"). Steps that follow a bound which moves
//! within each oscillation change at the same phase of each, and the energy grows without end: that of two particles of
//! snow that meet at a hundredth of the speed of waves, from 0.0125 J to 98 J. So the length changes seldom. It is cut
//! where the bound falls below it, by more than needed, and grows only after many steps in a row that would have allowed it.

use serde::{Deserialize, Serialize};

use crate::time_step::TimeStep;

/// Share of what is allowed that is taken where a length is cut.
const CUT: f64 = 0.9;
/// Of so many parts a longer length leaves nine tenths, or fewer.
const FEWER: f64 = 0.9;
/// Steps in a row that must allow a longer length before it is taken.
const PATIENCE: u32 = 256;

/// The length that is held: part of the state, since further steps depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct HeldLength {
    /// Equal parts of a step of the world; 0 before the first.
    parts: f64,
    /// Steps in a row that would have allowed fewer.
    good: u32,
}

impl HeldLength {
    /// Begins a step of the world, in which a longer length may begin.
    pub(crate) fn begin(&mut self) {
        if self.good >= PATIENCE {
            *self = Self { parts: self.fewer(), good: 0 };
        }
    }

    /// The length of the next step (s), at most `allowed` (s), of a step of the world of `dt` (s).
    pub(crate) fn length(&mut self, dt: f64, allowed: f64) -> f64 {
        let needed = TimeStep::divide(dt, allowed);
        if self.parts == 0.0 {
            self.parts = needed;
        } else if needed > self.parts {
            self.shorten(dt, CUT * allowed);
        }
        let may_grow = self.fewer() < self.parts && needed <= self.fewer();
        self.good = if may_grow { self.good + 1 } else { 0 };
        dt / self.parts
    }

    /// Cuts the length to `most` (s), or a little below.
    pub(crate) fn shorten(&mut self, dt: f64, most: f64) {
        *self = Self { parts: TimeStep::divide(dt, most).max(self.parts), good: 0 };
    }

    /// Parts of the next longer length: at least one.
    fn fewer(&self) -> f64 {
        (FEWER * self.parts).floor().max(1.0)
    }

    /// Its numbers for a hash of the state, where a further step may depend on them.
    pub(crate) fn numbers(&self) -> Option<[f64; 2]> {
        (self.parts > 1.0).then_some([self.parts, f64::from(self.good)])
    }
}

#[cfg(test)]
mod tests {
    use super::{HeldLength, PATIENCE};

    #[test]
    fn a_length_is_held_while_a_bound_moves_and_grows_only_after_many_steps() {
        let mut hold = HeldLength::default();
        assert_eq!(hold.length(1.0, 0.26), 0.25);
        // A bound that oscillates above it changes nothing.
        for step in 0..1000 {
            hold.begin();
            assert_eq!(hold.length(1.0, 0.3 + 0.04 * f64::from(step % 3)), 0.25);
        }
        // It is cut by more than needed, and not cut again by what stays within that.
        let cut = hold.length(1.0, 0.24);
        assert_eq!(cut, 0.2);
        assert_eq!(hold.length(1.0, 0.205), cut);
        // It grows after so many steps that would allow it in a row, as a step of the world begins.
        for _ in 0..PATIENCE {
            assert_eq!(hold.length(1.0, 0.3), cut);
        }
        hold.begin();
        assert_eq!(hold.length(1.0, 0.3), 0.25);
        // One that would not begins the count anew.
        for step in 0..2 * PATIENCE {
            hold.begin();
            assert_eq!(hold.length(1.0, if step % PATIENCE == 0 { 0.3 } else { 0.4 }), 0.25);
        }
    }

    #[test]
    fn a_whole_number_of_parts_is_held_where_its_quotient_is_rounded() {
        let mut hold = HeldLength::default();
        let allowed = 1.0 / 3.0 * (1.0 - 1e-12);
        for _ in 0..10 {
            assert_eq!(hold.length(1.0, allowed), 1.0 / 3.0);
        }
    }
}
