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

/// Share of what is allowed that is taken where a length changes.
const SHARE: f64 = 0.9;
/// Of so many parts a longer length leaves four fifths, or fewer: after a cut the same bound asks for nine tenths.
const FEWER: f64 = 0.8;
/// Steps in a row that must allow a longer length before it is taken.
const PATIENCE: u32 = 256;
/// More parts than any step is divided into.
const MOST: f64 = 1e9;

/// The length that is held: part of the state, since further steps depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct HeldLength {
    /// Equal parts of a step of the world; 0 before the first.
    parts: f64,
    /// Steps in a row that would have allowed fewer, and the parts that all of them would have allowed.
    good: u32,
    needed: f64,
}

impl HeldLength {
    /// The length of the next step (s), at most `allowed` (s), of a step of the world of `dt` (s).
    pub(crate) fn length(&mut self, dt: f64, allowed: f64) -> f64 {
        let needed = TimeStep::divide(dt, allowed);
        if self.parts == 0.0 {
            self.parts = needed;
        } else if needed > self.parts {
            self.shorten(dt, SHARE * allowed);
        }

        let fewer = (FEWER * self.parts).floor().max(1.0);
        if needed > fewer || fewer == self.parts {
            (self.good, self.needed) = (0, 0.0);
        } else {
            (self.good, self.needed) = (self.good + 1, self.needed.max(needed));
        }
        if self.good == PATIENCE {
            *self = Self { parts: (self.needed / SHARE).round().min(fewer), ..Self::default() };
        }
        dt / self.parts
    }

    /// Cuts the length to `most` (s), or a little below.
    pub(crate) fn shorten(&mut self, dt: f64, most: f64) {
        *self = Self { parts: TimeStep::divide(dt, most).max(self.parts), ..Self::default() };
    }

    /// Its numbers for a hash of the state, where a further step may depend on them.
    pub(crate) fn numbers(&self) -> Option<[f64; 3]> {
        (self.parts > 1.0).then_some([self.parts, f64::from(self.good), self.needed])
    }

    /// All of its numbers, of which [`Self::of_numbers`] makes it again.
    pub(crate) fn all_numbers(self) -> [f64; 3] {
        [self.parts, f64::from(self.good), self.needed]
    }

    /// The length that has these numbers; none if no length has.
    pub(crate) fn of_numbers([parts, good, needed]: [f64; 3]) -> Option<Self> {
        let is_count = |number: f64| (0.0..=MOST).contains(&number) && number.fract() == 0.0;
        let fits = [parts, good, needed].into_iter().all(is_count) && good < f64::from(PATIENCE);
        fits.then_some(Self { parts, good: good as u32, needed })
    }
}

#[cfg(test)]
mod tests {
    use super::{HeldLength, PATIENCE};

    #[test]
    fn a_length_is_held_while_a_bound_moves_and_grows_only_after_many_steps() {
        let mut held = HeldLength::default();
        assert_eq!(held.length(1.0, 0.26), 0.25);
        // A bound that oscillates above it changes nothing.
        for step in 0..1000 {
            assert_eq!(held.length(1.0, 0.3 + 0.04 * f64::from(step % 3)), 0.25);
        }
        // It is cut by more than needed, and not cut again by what stays within that.
        let cut = held.length(1.0, 0.24);
        assert_eq!(cut, 0.2);
        assert_eq!(held.length(1.0, 0.205), cut);
        // It grows after so many steps in a row that would allow it.
        for _ in 1..PATIENCE {
            assert_eq!(held.length(1.0, 0.3), cut);
        }
        assert_eq!(held.length(1.0, 0.3), 0.25);
        // One that would not begins the count anew.
        for step in 0..2 * PATIENCE {
            assert_eq!(held.length(1.0, if step % PATIENCE == 0 { 0.3 } else { 0.4 }), 0.25);
        }
    }

    #[test]
    fn a_length_goes_on_from_its_numbers() {
        let mut held = HeldLength::default();
        for allowed in [0.26, 0.24, 0.3, 0.3, 0.3] {
            held.length(1.0, allowed);
        }
        assert_eq!(HeldLength::of_numbers(held.all_numbers()), Some(held));
        assert_eq!(HeldLength::of_numbers([0.0; 3]), Some(HeldLength::default()));
        for wrong in
            [[-1.0, 0.0, 0.0], [1.5, 0.0, 0.0], [1e10, 0.0, 0.0], [1.0, 256.0, 0.0], [1.0, 0.0, f64::NAN]]
        {
            assert_eq!(HeldLength::of_numbers(wrong), None, "{wrong:?}");
        }
    }

    #[test]
    fn a_bound_that_falls_for_a_moment_costs_no_more_than_that_many_steps() {
        let mut held = HeldLength::default();
        held.length(1.0, 0.1);
        assert!(held.length(1.0, 1e-5) <= 0.9e-5);
        let short = (0..PATIENCE).filter(|_| held.length(1.0, 0.1) < 0.09).count();
        assert_eq!(short + 1, PATIENCE as usize, "the last is long again: {held:?}");
        assert!(held.length(1.0, 0.1) <= 0.1);
    }

    #[test]
    fn a_whole_number_of_parts_is_held_where_its_quotient_is_rounded() {
        let mut held = HeldLength::default();
        let allowed = 1.0 / 3.0 * (1.0 - 1e-12);
        for _ in 0..10 {
            assert_eq!(held.length(1.0, allowed), 1.0 / 3.0);
        }
    }
}
