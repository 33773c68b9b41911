//! Ranges of numbers, and those that several sections share.

use std::fmt;

use nappe_sim::{math::number, world::allowed};

/// The numbers that a key allows: from the first to the second, both included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Range(pub f64, pub f64);

/// Coordinates (m).
pub(crate) const LENGTH: Range = Range::of(allowed::LENGTH);
/// Radii and edges (m).
pub(crate) const SIZE: Range = Range(1e-6, 1e6);
/// Distances over which points are joined (m).
pub(crate) const WELD: Range = Range(0.0, 1e3);
/// Components of a velocity (m/s).
pub(crate) const SPEED: Range = Range::of(allowed::SPEED);
/// Components of a direction, whose length does not matter.
pub(crate) const DIRECTION: Range = Range(-1e6, 1e6);

impl Range {
    /// The numbers that a change of parameters allows.
    pub(crate) const fn of([low, high]: [f64; 2]) -> Self {
        Self(low, high)
    }

    pub(super) fn holds(self, value: f64) -> bool {
        (self.0..=self.1).contains(&value)
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} to {}", number(self.0), number(self.1))
    }
}
