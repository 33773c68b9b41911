//! How a cloth is stepped: its integrator, its solver, its limits, and what its states are evaluated for.
//!
//! Enters: what a scene says. Leaves: choices that no step changes. Modules in reading order:

mod integrator;
mod surface;
mod rest;
mod cloth;
mod scheme;
mod purpose;

pub use cloth::{ClothSettings, Hessian, Minimizer, MinimizerKind, NewtonSettings, OnPass, StateLimits};
pub use integrator::Integrator;
pub(super) use purpose::{Aim, Bounded, Descend, Explicit, Implicit, Purpose, Resultant, RightHandSide};
pub use rest::RestSettings;
pub(super) use scheme::{Scheme, error_constant};
pub use surface::{SurfaceCheck, SurfaceSettings};
