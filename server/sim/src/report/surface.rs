//! What keeping the surfaces of cloth apart tells.

use serde::{Deserialize, Serialize};

/// Pairs of parts of a surface that could meet, and what kept them apart, in the last sub-step of a step of the world where
/// nothing else is said.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceReport {
    /// Pairs that could meet within the sub-step: a vertex and a triangle, or two edges.
    pub pairs: u64,
    /// Those of them that pushed in its last solve.
    pub active: u64,
    /// The most solves that a sub-step made, at each of which pairs were added or dropped.
    pub rounds: u32,
    /// The least distance (m) of a pair at the end of any sub-step; infinite where none had a pair.
    pub least_gap: f64,
    /// Sub-steps that were not accepted since pairs could not be kept apart.
    pub failed: u64,
    /// The most edges that cross triangles at the end of a sub-step, counted exactly; none where nothing counts them.
    pub crossings: Option<u64>,
    /// How far (m) the corner of a figure that is farthest from its frame is off it, at the end.
    pub yield_m: f64,
    /// Corners of figures that are off by more than 1 mm, at the end.
    pub yielding: u64,
    /// The largest force (N) with which a pair pushed in the last solve of any sub-step; 0 where none pushed.
    pub largest_push: f64,
}

impl Default for SurfaceReport {
    fn default() -> Self {
        Self {
            pairs: 0,
            active: 0,
            rounds: 0,
            least_gap: f64::INFINITY,
            failed: 0,
            crossings: None,
            yield_m: 0.0,
            yielding: 0,
            largest_push: 0.0,
        }
    }
}

impl SurfaceReport {
    /// This and the report of the sub-step after it.
    #[must_use]
    pub(crate) fn and(self, next: Self) -> Self {
        Self {
            pairs: next.pairs,
            active: next.active,
            rounds: self.rounds.max(next.rounds),
            least_gap: self.least_gap.min(next.least_gap),
            failed: self.failed + next.failed,
            crossings: self.crossings.max(next.crossings),
            yield_m: next.yield_m,
            yielding: next.yielding,
            largest_push: self.largest_push.max(next.largest_push),
        }
    }

    /// This and the report of another body in the same step.
    #[must_use]
    pub(crate) fn with(self, other: Self) -> Self {
        let crossings = self.crossings.into_iter().chain(other.crossings);
        Self {
            pairs: self.pairs + other.pairs,
            active: self.active + other.active,
            rounds: self.rounds.max(other.rounds),
            least_gap: self.least_gap.min(other.least_gap),
            failed: self.failed + other.failed,
            crossings: crossings.reduce(|a, b| a + b),
            yield_m: self.yield_m.max(other.yield_m),
            yielding: self.yielding + other.yielding,
            largest_push: self.largest_push.max(other.largest_push),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIRST: SurfaceReport = SurfaceReport {
        pairs: 7,
        active: 5,
        rounds: 2,
        least_gap: 2e-3,
        failed: 1,
        crossings: None,
        yield_m: 0.01,
        yielding: 3,
        largest_push: 0.5,
    };
    const SECOND: SurfaceReport = SurfaceReport {
        pairs: 4,
        active: 3,
        rounds: 1,
        least_gap: 1e-3,
        failed: 2,
        crossings: Some(6),
        yield_m: 0.004,
        yielding: 2,
        largest_push: 0.25,
    };

    #[test]
    fn of_two_sub_steps_the_last_has_the_pairs_and_what_yields() {
        let both = SurfaceReport { rounds: 2, failed: 3, largest_push: 0.5, ..SECOND };
        assert_eq!(FIRST.and(SECOND), both);
        let back = SurfaceReport { pairs: 7, active: 5, yield_m: 0.01, yielding: 3, ..both };
        assert_eq!(SECOND.and(FIRST), back);
    }

    #[test]
    fn of_two_bodies_all_pairs_count() {
        let yields = SurfaceReport { yield_m: 0.01, yielding: 5, largest_push: 0.5, ..SECOND };
        let both = SurfaceReport { pairs: 11, active: 8, rounds: 2, failed: 3, ..yields };
        assert_eq!(FIRST.with(SECOND), both);
        let twice =
            SurfaceReport { pairs: 8, active: 6, failed: 4, crossings: Some(12), yielding: 4, ..SECOND };
        assert_eq!(SECOND.with(SECOND), twice);
    }

    #[test]
    fn nothing_counted_changes_nothing() {
        for report in [FIRST, SECOND] {
            assert_eq!(report.with(SurfaceReport::default()), report);
        }
    }
}
