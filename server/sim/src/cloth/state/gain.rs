//! What is known of the energy of a cloth while it is stepped: over the run, at the start of a sub-step, and what a sub-step may have.

use serde::{Deserialize, Serialize};

/// What is known of the energy over a run.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Gain {
    /// Of explicit steps: by how much it (J) is above that of the start, what pins and the medium gave since taken off. Of
    /// implicit ones: what contacts gave and nothing paid back yet.
    pub(crate) energy: f64,
    /// The longest sub-step so far over its bound.
    pub(crate) ratio: f64,
    /// Of explicit steps: the most that moved and was stretched so far (J), less what was gained by then.
    pub(crate) motion: f64,
}

/// What is known of a state that a sub-step starts from.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Start {
    /// Kinetic, elastic and gravitational energy (J).
    pub(crate) energy: f64,
    /// What pins and the medium add (W), of explicit steps with a bound.
    pub(crate) power: f64,
    /// The inverse of the longest step (1/s), of explicit steps with a bound.
    pub(crate) rate: f64,
    /// What the air and given forces add (J) in the sub-step, and what the method adds to a fall, by its definition.
    pub(crate) own: f64,
}

/// What energy a step that is accepted may have, before contacts and after them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Allowance {
    /// What pins and the medium gave, and rounding (J).
    pub(crate) given: f64,
    /// By how much the energy rises before contacts, at least by what was given (J).
    pub(crate) limit: f64,
    /// What may be owed for contacts after it (J).
    pub(crate) most: f64,
    /// Whether what it gains without a contact is owed too.
    pub(crate) owes: bool,
}

/// Whether what contacts give is told apart: not where something began the sub-step inside a solid, or solids move, which give
/// energy themselves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Judged {
    Yes,
    #[default]
    No,
}

impl From<bool> for Judged {
    fn from(is_judged: bool) -> Self {
        if is_judged { Self::Yes } else { Self::No }
    }
}
