//! What the kernels of an evaluation add up, as types that they are compiled for.

/// What kernels add up.
pub(super) trait Aim {
    /// A right-hand side, its matrix and the diagonal of it, in place of accelerations.
    const HAS_MATRIX: bool = false;
    /// Energies, power and the largest stretch.
    const HAS_FIGURES: bool = true;
    /// The matrix is kept for products.
    const FREEZES: bool = Self::HAS_MATRIX;
    /// The right-hand side takes what the matrix makes of the velocities: it is that of a step from the state.
    const IS_STEP: bool = false;
    /// There it takes the exact derivative, whatever the matrix makes of compressed springs.
    const IS_EXACT: bool = false;
    /// What bounds an explicit step.
    const IS_BOUNDED: bool = false;
}

/// Accelerations, without a bound on what is done with them.
pub(super) struct Explicit;
/// Accelerations, and what bounds the length of their step.
pub(super) struct Bounded;
/// The linear solve of a step from the state.
pub(super) struct Implicit;
/// The same of a step that ends beyond its minimum.
pub(super) struct Middle;
/// A linear solve from an iterate: forces and the matrix.
pub(super) struct Iterate;
/// Particles that move one by one: forces and the diagonal of the matrix.
pub(super) struct Descend;

impl Aim for Explicit {}

impl Aim for Bounded {
    const IS_BOUNDED: bool = true;
}

impl Aim for Implicit {
    const HAS_MATRIX: bool = true;
    const IS_STEP: bool = true;
}

impl Aim for Middle {
    const HAS_MATRIX: bool = true;
    const IS_STEP: bool = true;
    const IS_EXACT: bool = true;
}

impl Aim for Iterate {
    const HAS_MATRIX: bool = true;
}

impl Aim for Descend {
    const HAS_MATRIX: bool = true;
    const FREEZES: bool = false;
    const HAS_FIGURES: bool = false;
}
