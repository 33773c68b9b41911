//! How a step of the world was divided for the cloths, and which steps were taken again.

use serde::{Deserialize, Serialize};

use super::{bound::TimeBound, failure::StepFailure};
use crate::linalg::PreconditionerKind;

/// Estimated error of positions that one sub-step makes (m), over free particles.
///
/// It is the leading term of the error of one step from an exact state: h |dv| / 2 for a method of order 1, and
/// h² |a' - a| / 6 for velocity Verlet. Contacts are not in it.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct ErrorEstimate {
    /// Root of the mean square (m).
    pub rms: f64,
    /// Largest (m).
    pub largest: f64,
    /// What both count of linear solves that ended at their iteration cap, above their tolerance: about how far the particle
    /// is off that is furthest off (m).
    pub of_solve: f64,
}

impl ErrorEstimate {
    /// The greater of both, one by one.
    #[must_use]
    pub(crate) fn max(self, other: Self) -> Self {
        Self {
            rms: self.rms.max(other.rms),
            largest: self.largest.max(other.largest),
            of_solve: self.of_solve.max(other.of_solve),
        }
    }
}

/// Sub-steps of all cloths of a world within one of its steps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClothSteps {
    /// How many were taken.
    pub substeps: u32,
    /// How many were not accepted, and taken again shorter.
    pub rejected: u32,
    /// How many of them, over all bodies, were implicit Euler's in place of BDF2's: the first, and those after a change of state
    /// or forces from outside. What touches colliders keeps its history.
    pub without_history: u32,
    /// Linear solves of the body that made most of them in these; 0 where nothing is solved.
    pub solves: u32,
    /// Length of the last one (s).
    pub dt: f64,
    /// The bound on the next one.
    pub bound: TimeBound,
    /// The largest of all bodies and sub-steps.
    pub error: ErrorEstimate,
    /// That of the solve which is reported; none where no linear system is solved.
    pub preconditioner: Option<PreconditionerKind>,
}

/// A sub-step of the cloths that was not accepted: none of them moved, and a shorter one was taken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rejection {
    /// Simulated time at its start (s).
    pub time: f64,
    /// Its length (s).
    pub dt: f64,
    /// Name of the cloth.
    pub body: String,
    /// Why; particles over all bodies.
    pub cause: StepFailure,
}
