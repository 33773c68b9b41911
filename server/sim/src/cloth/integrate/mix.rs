//! How much of the absolute tangent the linear solves of Newton's method add to the exact one.
//!
//! The exact tangent leads to a minimum in a few solves, where it is positive definite along what a solve looks at. Where it
//! is not, a share t of what the absolute tangent has beyond it is added: t from a twentieth up, and at the next iterate a
//! quarter of it.

/// The share of the absolute tangent that is added first.
const LEAST: f64 = 0.05;
/// The share below which none is added.
const NONE: f64 = 0.02;

/// A tangent: exact + t (absolute - exact). The more there is of the absolute one, the greater.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(super) struct Mix {
    /// t, from 0 to 1.
    share: f64,
}

impl Mix {
    pub(super) const EXACT: Self = Self { share: 0.0 };
    pub(super) const ABSOLUTE: Self = Self { share: 1.0 };

    /// What a solve is tried with where one before it did not do: twice as much of the absolute tangent.
    pub(super) fn with_more(self) -> Self {
        Self { share: if self.share < LEAST { LEAST } else { (2.0 * self.share).min(1.0) } }
    }

    /// What the next iterate begins with: a quarter of it.
    pub(super) fn with_less(self) -> Self {
        let share = 0.25 * self.share;
        Self { share: if share < NONE { 0.0 } else { share } }
    }

    /// What a negative transverse ratio is multiplied by.
    pub(super) fn mirror(self) -> f64 {
        1.0 - 2.0 * self.share
    }
}

#[cfg(test)]
mod tests {
    use super::Mix;

    #[test]
    fn shares_go_up_to_the_absolute_tangent_and_back_to_the_exact_one() {
        let up: Vec<f64> =
            std::iter::successors(Some(Mix::EXACT), |mix| (*mix < Mix::ABSOLUTE).then(|| mix.with_more()))
                .map(|mix| mix.share)
                .collect();
        assert_eq!(up, [0.0, 0.05, 0.1, 0.2, 0.4, 0.8, 1.0]);
        let down: Vec<f64> =
            std::iter::successors(Some(Mix::ABSOLUTE), |mix| (*mix > Mix::EXACT).then(|| mix.with_less()))
                .map(|mix| mix.share)
                .collect();
        assert_eq!(down, [1.0, 0.25, 0.0625, 0.0]);
        assert_eq!(Mix { share: 0.1 }.with_less().with_more().share, 0.05);
        assert_eq!([Mix::EXACT, Mix { share: 0.5 }, Mix::ABSOLUTE].map(Mix::mirror), [1.0, 0.0, -1.0]);
    }
}
