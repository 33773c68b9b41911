//! What is known of the energy of a cloth while a sub-step is tried: at its start, and what it may have.

use super::Total;

/// What is known of a state that a sub-step starts from.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Start {
    /// Kinetic, elastic and gravitational energy (J).
    pub(crate) energy: f64,
    /// What an explicit method keeps of linear motion, less that (J).
    pub(crate) kept: f64,
    pub(crate) total: Total,
    /// That of the last kick of an explicit step.
    pub(crate) last_kick: Total,
    /// The inverse of the longest step (1/s), of explicit steps with a bound.
    pub(crate) rate: f64,
    /// What symplectic Euler makes of the fall of several parts that no pin holds (J): positions feel the velocity after it.
    pub(crate) fall: f64,
    /// What contacts gave (N s).
    pub(crate) impulse: [f64; 3],
    /// What the medium, given forces and colliders add (J) in the sub-step, and what the method adds to a fall, by its
    /// definition.
    pub(crate) own: f64,
}

/// What energy a step that is accepted may have, before contacts and after them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Allowance {
    /// What pins, the medium and colliders gave, and rounding (J).
    pub(crate) given: f64,
    /// What the medium takes and what a method loses of a fall (J): what comes to rest on a surface loses neither.
    pub(crate) at_rest: f64,
    /// By how much the energy rises before contacts, at least by what was given (J).
    pub(crate) limit: f64,
    /// Whether what it gains is judged: not where a corner of a figure gives way.
    pub(crate) judged: Judged,
    /// Whether what it gains without a contact is owed too.
    pub(crate) owes: bool,
    /// Before the sub-step, and after it without contacts.
    pub(crate) totals: [Total; 2],
}

/// Whether what contacts give is told apart: not where something began the sub-step inside a solid, which is moved out.
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
