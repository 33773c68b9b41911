//! A sub-step: how long it is, and when it ends.

/// A part of a step of the world, or all of it, in which bodies go on and meet colliders.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SubStep {
    /// Length (s).
    pub(crate) dt: f64,
    /// Time at its end (s).
    pub(crate) end: f64,
}

impl SubStep {
    /// Time at its start (s).
    pub(crate) fn start(self) -> f64 {
        self.end - self.dt
    }

    /// Times at its start and its end (s).
    pub(crate) fn times(self) -> [f64; 2] {
        [self.start(), self.end]
    }
}
