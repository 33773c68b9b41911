//! What an evaluation is made for: its settings in, and a name out for each aim of its kernels.

use super::{bound::Bounds, settings::ClothSettings};
use crate::{linalg::PreconditionerKind, report::BoundKind};

/// What an evaluation is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// A step that divides forces by masses; or energies alone.
    Explicit,
    /// The same, with a bound of this kind on its length.
    Bounded(BoundKind),
    /// A step that makes one linear solve from the state.
    Implicit(PreconditionerKind),
    /// An iterate of a step that makes more than one.
    Iterate(PreconditionerKind),
}

impl Purpose {
    /// What a state is evaluated for, that steps start from.
    pub(super) fn of(settings: &ClothSettings) -> Self {
        match settings.integrator {
            _ if settings.solves_from_state() => Self::Implicit(settings.solver.preconditioner),
            integrator if integrator.is_implicit() => Self::Explicit,
            _ if settings.time_step.is_unchecked() => Self::Explicit,
            integrator => Self::Bounded(Bounds::<f64>::kind(integrator)),
        }
    }

    /// Whether there is a matrix to be solved with.
    pub(super) fn has_matrix(self) -> bool {
        matches!(self, Self::Implicit(_) | Self::Iterate(_))
    }
}
