//! Linear systems of 3-vectors.

mod settings;

pub use settings::{OperatorKind, Outcome, PreconditionerKind, SolveReport, SolverSettings, Stop};
