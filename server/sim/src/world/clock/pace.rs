//! How long the sub-steps of all cloths of a world are: what was accepted, and what the error estimates ask for.
//!
//! Enters: whether each sub-step was accepted, and its error beside the tolerance. Leaves: how long the next may be. It is
//! part of the state: further steps depend on it.

use serde::{Deserialize, Serialize};

use xxhash_rust::xxh3::Xxh3;

use crate::{
    held_length::HeldLength,
    report::{BoundKind, TimeBound},
};

/// How often a sub-step may be halved: a step below a 64th of what the scene asks for fails.
const HALVINGS: u32 = 6;
/// Sub-steps that must be accepted before they grow again.
const GOOD: u32 = 4;
/// How much of the length that would just meet the tolerance is taken.
const SAFETY: f64 = 0.9;
/// Exponents of the controller (Gustafsson 1991), as shares of those by which errors grow with the length.
const PROPORTIONAL: f64 = 0.4;
const INTEGRAL: f64 = 0.7;
/// By how much a sub-step may shrink or grow at a time.
const CHANGE: [f64; 2] = [0.2, 2.0];

/// How long sub-steps are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Pace {
    /// How often sub-steps are halved.
    halvings: u32,
    /// How many were accepted since that changed.
    good: u32,
    /// What the tolerance asks for (s), and the strain of the last accepted sub-step; none without tolerance.
    controlled: Option<[f64; 2]>,
    /// What the bounds of explicit cloths allow.
    hold: HeldLength,
}

impl Pace {
    /// The bound on a sub-step, of which the scene asks for `asked` (s); infinite where the pace has none.
    pub(crate) fn bound(&self, asked: f64) -> TimeBound {
        let halved = asked * 0.5_f64.powi(self.halvings.cast_signed());
        let controlled = self.controlled.map_or(f64::INFINITY, |[length, _]| length);
        let (kind, dt) = if controlled < halved {
            (BoundKind::Tolerance, controlled)
        } else if self.halvings > 0 {
            (BoundKind::Acceptance, halved)
        } else {
            (BoundKind::Frame, f64::INFINITY)
        };
        TimeBound { kind, dt, particle: None }
    }

    /// The longest next sub-step (s) of a step of the world of `dt` (s), of which the scene asks for `asked` (s) and bounds
    /// allow `certified` (s).
    pub(crate) fn length(&mut self, dt: f64, asked: f64, certified: f64) -> f64 {
        self.bound(asked).dt.min(self.hold.length(dt, certified))
    }

    /// Takes over that a sub-step of `dt` (s) was accepted. `strain` is the largest of all cloths: how much longer it
    /// was than one that just meets the tolerance. `may_grow` says whether halved steps fit in twice their length.
    pub(crate) fn accept(&mut self, dt: f64, strain: Option<f64>, may_grow: impl FnOnce() -> bool) {
        self.good = self.good.saturating_add(1);
        if self.halvings > 0 && self.good >= GOOD && may_grow() {
            (self.halvings, self.good) = (self.halvings - 1, 0);
        }
        if let Some(strain) = strain {
            let strain = strain.max(1e-6);
            let last = self.controlled.map_or(strain, |[_, last]| last);
            let change = SAFETY * libm::pow(strain, -INTEGRAL) * libm::pow(last, PROPORTIONAL);
            self.controlled = Some([dt * change.clamp(CHANGE[0], CHANGE[1]), strain]);
        }
    }

    /// Takes over that a sub-step of `dt` (s) was not accepted, for its error if that has a strain; says whether a
    /// shorter one may be tried.
    pub(crate) fn reject(&mut self, dt: f64, asked: f64, strain: Option<f64>) -> bool {
        self.good = 0;
        if let Some(strain) = strain {
            let last = self.controlled.map_or(strain, |[_, last]| last);
            let length = dt * (SAFETY / strain).clamp(CHANGE[0], 0.5);
            self.controlled = Some([length, last]);
            return length >= asked * 0.5_f64.powi(HALVINGS.cast_signed());
        }
        // It may have been shorter than halvings alone ask for.
        while self.bound(asked).dt > 0.5 * dt * (1.0 + 1e-9) && self.halvings <= HALVINGS {
            self.halvings += 1;
            self.controlled = self.controlled.map(|[length, last]| [length.min(0.5 * dt), last]);
        }
        self.halvings <= HALVINGS
    }

    /// All of its numbers, of which [`Self::of_numbers`] makes it again.
    pub(crate) fn all_numbers(self) -> [f64; 7] {
        let [length, last] = self.controlled.unwrap_or_default();
        let [parts, held, needed] = self.hold.all_numbers();
        [f64::from(self.halvings), f64::from(self.good), length, last, parts, held, needed]
    }

    /// The pace that has these numbers; none if no pace has.
    pub(crate) fn of_numbers([halvings, good, length, last, hold @ ..]: [f64; 7]) -> Option<Self> {
        let is_count =
            |number: f64, most: u32| (0.0..=f64::from(most)).contains(&number) && number.fract() == 0.0;
        let is_amount = |number: f64| number.is_finite() && number >= 0.0;
        let fits = is_count(halvings, HALVINGS) && is_count(good, u32::MAX);
        if !fits || !is_amount(length) || !is_amount(last) {
            return None;
        }
        let controlled = (length > 0.0).then_some([length, last]);
        let hold = HeldLength::of_numbers(hold)?;
        Some(Self { halvings: halvings as u32, good: good as u32, controlled, hold })
    }

    /// Adds it to a hash of the state, unless nothing ever changed it.
    pub(crate) fn hash(&self, hasher: &mut Xxh3) {
        let Self { halvings, good, controlled, hold } = *self;
        if let Some(numbers) = hold.numbers() {
            hasher.update(numbers.map(f64::to_le_bytes).as_flattened());
        }
        if halvings > 0 || controlled.is_some() {
            let [length, last] = controlled.unwrap_or_default();
            hasher.update(
                [f64::from(halvings), f64::from(good), length, last].map(f64::to_le_bytes).as_flattened(),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pace_goes_on_from_its_numbers() {
        let mut pace = Pace::default();
        assert_eq!(Pace::of_numbers(pace.all_numbers()), Some(pace));
        assert!(pace.reject(0.01, 0.01, None));
        pace.length(0.01, 0.01, 0.004);
        pace.accept(0.002, Some(0.5), || false);
        assert_eq!(Pace::of_numbers(pace.all_numbers()), Some(pace));
        for (place, wrong) in [(0, 7.0), (0, 0.5), (1, -1.0), (2, f64::INFINITY), (3, f64::NAN), (4, 0.5)] {
            let mut numbers = pace.all_numbers();
            numbers[place] = wrong;
            assert_eq!(Pace::of_numbers(numbers), None, "{place}: {wrong}");
        }
    }
}
