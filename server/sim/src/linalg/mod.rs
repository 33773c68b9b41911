//! Linear systems of 3-vectors: operators, preconditioners, conjugate gradient, minimal residuals.

mod settings;
mod sixteens;
mod rows;
mod coarse;
mod operator;
mod block_csr;
mod precondition;
mod two_level;
mod dot;
mod cg;
mod patches;
mod solve;
mod minres;

pub use block_csr::BlockCsr;
pub use cg::{CgWorkspace, conjugate_gradient};
pub(crate) use coarse::NineByNine;
pub use coarse::{CoarseInverse, CoarseLayout, CoarseMatrix};
pub use minres::{MinresWorkspace, minres};
pub use operator::{LinearOperator, Preconditioner, Room, WholeOperator, WholePreconditioner};
pub(crate) use patches::{MatrixParts, TakeParts};
pub use patches::{PatchLayout, PatchMatrix, Patches, patch_bytes};
pub use precondition::{BlockJacobi, Identity, Inverse3, Symmetric3};
pub use settings::{AtCap, OperatorKind, Outcome, PreconditionerKind, SolveReport, SolverSettings, Stop};
pub(crate) use sixteens::{
    Sums, add_lanes, lane_sums, lanes_at, load_six, packs, packs_at, store_padded, widen_six,
};
pub(crate) use solve::{System, solve};
pub use two_level::TwoLevel;
