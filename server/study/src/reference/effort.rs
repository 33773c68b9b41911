//! Classes of effort: how much counted work a run of a reference may take. No clock has a part in them.

use std::fmt;

/// Evaluations of the force on a particle in a run of a reference of cloth of the first class, and steps of particles of snow.
const OF_CLOTH: u64 = 3_125_000;
const OF_SNOW: u64 = 1_562_500;
/// A step of few particles takes as long as one of so many more.
pub(crate) const OVERHEAD: u64 = 100;

/// A class of effort, E0 and up: a run of a reference may take four times as much work as one of the class before. What a study finds
/// by a class is the same on any machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Effort(u8);

impl Effort {
    /// The class of studies whose time is not limited: 2e8 evaluations of the force on a particle, 1e8 steps of particles of snow.
    pub const DEFAULT: Self = Self(3);
    /// The largest class, a run of which takes days.
    pub const MOST: u8 = 9;

    /// That of a number, up to [`Self::MOST`].
    pub const fn new(class: u8) -> Option<Self> {
        if class <= Self::MOST { Some(Self(class)) } else { None }
    }

    /// The number that `--effort` takes and results tell.
    pub const fn class(self) -> u8 {
        self.0
    }

    /// Evaluations of the force on a particle that a run of a reference of cloth takes at most, beyond which steps are not halved again.
    pub const fn of_cloth(self) -> u64 {
        OF_CLOTH << (2 * self.0)
    }

    /// Steps of particles that a run of a reference of snow takes at most, beyond which cells are not halved again.
    pub const fn of_snow(self) -> u64 {
        OF_SNOW << (2 * self.0)
    }

    /// The largest class whose work is at most so much; the first where none is.
    pub(super) fn within(work: f64, of: fn(Self) -> u64) -> Self {
        (0..=Self::MOST).rev().map(Self).find(|effort| of(*effort) as f64 <= work).unwrap_or(Self(0))
    }
}

impl fmt::Display for Effort {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "E{}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_class_takes_four_times_the_work_of_the_one_before() {
        let classes: Vec<Effort> = (0..=Effort::MOST).filter_map(Effort::new).collect();
        assert_eq!(classes.len(), usize::from(Effort::MOST) + 1);
        for pair in classes.windows(2) {
            assert_eq!(pair[1].of_cloth(), 4 * pair[0].of_cloth(), "{}", pair[1]);
            assert_eq!(pair[1].of_snow(), 4 * pair[0].of_snow(), "{}", pair[1]);
        }
        assert_eq!([Effort::DEFAULT.of_cloth(), Effort::DEFAULT.of_snow()], [200_000_000, 100_000_000]);
        assert_eq!((Effort::new(Effort::MOST + 1), Effort::DEFAULT.to_string()), (None, "E3".to_owned()));
    }

    #[test]
    fn the_largest_class_that_can_be_paid_is_taken() {
        for (work, class) in [(0.0, 0), (3.2e6, 0), (1.9e8, 2), (2e8, 3), (f64::INFINITY, Effort::MOST)] {
            assert_eq!(Effort::within(work, Effort::of_cloth).class(), class, "{work}");
        }
    }
}
