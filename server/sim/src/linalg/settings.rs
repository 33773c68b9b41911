//! What a linear solve is asked for and how it ends.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::names::names;

/// When a solve stops.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Stop {
    /// At |r| <= tolerance |b|, or after `max_iterations`. Conjugate gradient measures |r|² as r.z, z = M⁻¹ r with its
    /// preconditioner M; without one that is r.r.
    Residual {
        /// Relative residual, above 0 and below 1; what the precision cannot reach counts as reached.
        tolerance: f64,
        /// Iteration cap, at least 1.
        max_iterations: u32,
    },
    /// After so many iterations (Zara 2001 uses 10), or when the residual is as small as the precision lets it become.
    Iterations(u32),
}

/// Approximate inverse of the matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum PreconditionerKind {
    /// No preconditioner: residuals are taken as they are.
    Identity,
    /// Inverse of the diagonal.
    Diagonal,
    /// Inverse of the 3 x 3 diagonal blocks.
    BlockJacobi,
    /// The same and, added to it, an inverse on affine functions of the parts of each block of particles.
    TwoLevel,
    /// The inverse 3 x 3 blocks before and after an inverse on the soft functions of small patches of particles.
    Patches,
    /// Block Jacobi or two levels, chosen when a cloth is built: by its size, stiffness and damping and the step alone; and
    /// patches from where a solve comes to its cap.
    #[default]
    Auto,
}

names!(PreconditionerKind {
    Identity: "identity",
    Diagonal: "diagonal",
    BlockJacobi: "block_jacobi",
    TwoLevel: "two_level",
    Patches: "patches",
    Auto: "auto",
});

/// How the matrix is applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum OperatorKind {
    /// From positions and springs, never stored: the fast way.
    #[default]
    MatrixFree,
    /// Assembled in 3 x 3 blocks (the `MatAdj` of Zara 2001): the reference.
    Assembled,
}

names!(OperatorKind { MatrixFree: "matrix_free", Assembled: "assembled" });

/// What becomes of a solve that comes to its cap, where the preconditioner is chosen by the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum AtCap {
    /// It ends there.
    Stop,
    /// It goes on from there with patches, for which there is memory, and the solves after it begin with them.
    #[default]
    Patches,
}

/// Settings of a solve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolverSettings {
    /// When it stops.
    pub stop: Stop,
    /// Approximate inverse that residuals are multiplied by.
    pub preconditioner: PreconditionerKind,
    /// What becomes of it at the cap; of [`PreconditionerKind::Auto`] alone.
    pub at_cap: AtCap,
    /// How the matrix is applied.
    pub operator: OperatorKind,
    /// Start from the solution of the step before instead of 0.
    pub warm_start: bool,
    /// A residual, not over |b|, at which it may stop in any case, whatever the tolerance; 0: none.
    pub floor: f64,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self {
            stop: Stop::Residual { tolerance: 1e-4, max_iterations: 200 },
            preconditioner: PreconditionerKind::default(),
            at_cap: AtCap::default(),
            operator: OperatorKind::default(),
            warm_start: false,
            floor: 0.0,
        }
    }
}

/// How a solve ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Outcome {
    /// The residual met the tolerance.
    Converged,
    /// Stopped at the iteration cap.
    IterationCap,
    /// p^T A p < 0 at this iteration: the matrix is not positive definite.
    NegativeCurvature {
        /// Iteration, from 1.
        iteration: u32,
    },
    /// p^T A p = 0 within rounding at this iteration, while A p is not 0.
    ZeroCurvature {
        /// Iteration, from 1.
        iteration: u32,
    },
    /// A p = 0 within rounding while r is not: A is singular and b is outside its range.
    Singular {
        /// Iteration, from 1.
        iteration: u32,
    },
    /// r.z <= 0 at this iteration, 0 being the start: the preconditioner is not positive definite.
    IndefinitePreconditioner {
        /// Iterations made before.
        iteration: u32,
    },
    /// A number left the range of its precision: in b (iteration 0), or in p^T A p or the residual.
    NotFinite {
        /// Iteration, from 1; 0 before the first.
        iteration: u32,
    },
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Converged => f.write_str("converged"),
            Self::IterationCap => f.write_str("iteration cap reached"),
            Self::NegativeCurvature { iteration } => write!(f, "negative curvature at iteration {iteration}"),
            Self::ZeroCurvature { iteration } => write!(f, "zero curvature at iteration {iteration}"),
            Self::Singular { iteration } => write!(f, "singular matrix at iteration {iteration}"),
            Self::IndefinitePreconditioner { iteration } => {
                write!(f, "indefinite preconditioner after iteration {iteration}")
            }
            Self::NotFinite { iteration } => write!(f, "a number out of range at iteration {iteration}"),
        }
    }
}

/// What a solve reports.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolveReport {
    /// How it ended.
    pub outcome: Outcome,
    /// Iterations made; 0 when b is 0.
    pub iterations: u32,
    /// Products with the matrix: one per iteration, and those that compute a residual from a solution.
    pub products: u32,
    /// |r| / |b| of the solution returned (0 when b = 0), in the norm in which [`Stop::Residual`] measures. Where a
    /// solve converged, it was computed from the solution. NaN where nothing was solved.
    pub relative_residual: f64,
    /// |r| of the solution returned, in the same norm; 0 where nothing was solved. Of a cloth, whose solution is a change of
    /// velocities, its square is an energy (J).
    pub residual: f64,
    /// Approximate inverse that residuals were multiplied by, of solves of cloth; never [`PreconditionerKind::Auto`].
    pub preconditioner: Option<PreconditionerKind>,
}

impl SolveReport {
    /// Of a solve that ended before its first iteration.
    pub(crate) const fn at_once(outcome: Outcome, relative_residual: f64) -> Self {
        Self { outcome, iterations: 0, products: 0, relative_residual, residual: 0.0, preconditioner: None }
    }

    /// The one of two solves with the larger residual, the later of equal ones; with the iterations and products of
    /// both. A residual that is not a number is the largest.
    #[must_use]
    pub fn and(self, later: Self) -> Self {
        let worse =
            if self.relative_residual.total_cmp(&later.relative_residual).is_gt() { self } else { later };
        Self {
            iterations: self.iterations.saturating_add(later.iterations),
            products: self.products.saturating_add(later.products),
            ..worse
        }
    }

    /// The same with the iterations and products of another solve, of which no more counts.
    #[must_use]
    pub(crate) fn beside(self, other: Self) -> Self {
        Self {
            iterations: self.iterations.saturating_add(other.iterations),
            products: self.products.saturating_add(other.products),
            ..self
        }
    }
}
