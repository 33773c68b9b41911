//! What an evaluation is made for, and what its kernels add up for that.

use super::cloth::ClothSettings;
use crate::{linalg::PreconditionerKind, report::BoundKind};

/// What an evaluation is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// A step that divides forces by masses; or energies alone.
    Explicit,
    /// The forces themselves, of pins too: to be looked at.
    Resultant,
    /// As for a step that divides forces by masses, with a bound of this kind on its length.
    Bounded(BoundKind),
    /// A step that makes one linear solve from the state.
    Implicit(PreconditionerKind),
    /// An iterate of a step that makes more than one.
    Iterate(PreconditionerKind),
}

impl Purpose {
    /// What a state is evaluated for, that steps start from.
    pub(crate) fn of(settings: &ClothSettings) -> Self {
        match settings.integrator {
            _ if settings.solves_from_state() => Self::Implicit(settings.solver.preconditioner),
            integrator if integrator.is_implicit() => Self::Explicit,
            _ if settings.time_step.is_unchecked() => Self::Explicit,
            integrator => Self::Bounded(integrator.bound()),
        }
    }

    /// Whether there is a matrix to be solved with.
    pub(crate) fn has_matrix(self) -> bool {
        matches!(self, Self::Implicit(_) | Self::Iterate(_))
    }
}

/// The right-hand side of an implicit step, what springs and elements add to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RightHandSide {
    /// h f: that of an iterate.
    Forces,
    /// h (f + h df/dx v), with what the matrix makes of compressed springs: that of a step from the state.
    Step,
    /// The same with the exact derivative, whatever the matrix makes of compressed springs: of a step that ends beyond its
    /// minimum.
    ExactStep,
}

/// What kernels add up, as types that they are compiled for.
pub(crate) trait Aim {
    /// A right-hand side, its matrix and the diagonal of it, in place of accelerations.
    const HAS_MATRIX: bool = false;
    /// Energies, power and the largest stretch.
    const HAS_FIGURES: bool = true;
    /// The matrix is kept for products.
    const FREEZES: bool = Self::HAS_MATRIX;
    /// What bounds an explicit step.
    const IS_BOUNDED: bool = false;
    /// Forces in place of accelerations, of pins too.
    const KEEPS_FORCES: bool = false;
}

/// Accelerations, without a bound on what is done with them.
pub(crate) struct Explicit;
/// Forces, of pins too.
pub(crate) struct Resultant;
/// Accelerations, and what bounds the length of their step.
pub(crate) struct Bounded;
/// A linear solve, from the state or an iterate.
pub(crate) struct Implicit;
/// Particles that move one by one: forces and the diagonal of the matrix.
pub(crate) struct Descend;

impl Aim for Explicit {}

impl Aim for Resultant {
    const KEEPS_FORCES: bool = true;
}

impl Aim for Bounded {
    const IS_BOUNDED: bool = true;
}

impl Aim for Implicit {
    const HAS_MATRIX: bool = true;
}

impl Aim for Descend {
    const HAS_MATRIX: bool = true;
    const FREEZES: bool = false;
    const HAS_FIGURES: bool = false;
}
