//! How a body's steps are solved, and when its state counts as diverged, as they are written in a scene.

use nappe_sim::linalg::{OperatorKind, PreconditionerKind};
use serde::{Deserialize, Serialize};

use crate::names;

/// Linear solver of an implicit step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Solver {
    /// The relative residual at which it stops; none: 1e-4, 0.01 with Newton's method, unless `fixed_iterations` is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// The most iterations that it makes; none: 200, 2000 with Newton's method, unless `fixed_iterations` is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_iterations: Option<u32>,
    /// Makes exactly so many iterations; none: stops by its residual.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fixed_iterations: Option<u32>,
    /// Approximate inverse; default: the inverse of the 3 x 3 diagonal blocks.
    #[serde(with = "names::preconditioner")]
    pub preconditioner: PreconditionerKind,
    /// How the matrix is applied; default: from positions and springs, without storing it.
    #[serde(with = "names::operator")]
    pub operator: OperatorKind,
    /// Start from the solution of the step before.
    pub warm_start: bool,
}

/// When a body's state counts as diverged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Limits {
    /// Largest length over rest length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_stretch: Option<f64>,
    /// Largest kinetic plus elastic energy (J).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_energy: Option<f64>,
}
