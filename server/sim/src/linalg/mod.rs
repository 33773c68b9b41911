//! Linear systems of 3-vectors: operators, preconditioners, conjugate gradient, minimal residuals.

mod settings;
mod block_csr;
mod precondition;
mod dot;
mod cg;
mod minres;

pub use block_csr::BlockCsr;
pub use cg::{CgWorkspace, conjugate_gradient};
pub use minres::{MinresWorkspace, WholeOperator, minres};
pub use precondition::{BlockJacobi, Diagonal, Identity, Symmetric3};
pub use settings::{OperatorKind, Outcome, PreconditionerKind, SolveReport, SolverSettings, Stop};

pub(crate) use dot::{block_sums, combine};

use crate::math::{Padded, Real, Vec3};

/// A square matrix of 3 x 3 blocks, applied block of rows by block of rows.
pub trait LinearOperator<R: Real>: Sync {
    /// Writes rows `first_row..first_row + out.len()` of A p.
    fn apply(&self, first_row: usize, p: &[Padded<R>], out: &mut [Vec3<R>]);
}

/// An approximate inverse, applied row by row.
pub trait Preconditioner<R: Real>: Sync {
    /// Writes rows `first_row..first_row + r.len()` of M⁻¹ r into `z`.
    fn apply(&self, first_row: usize, r: &[Vec3<R>], z: &mut [Vec3<R>]);
}
