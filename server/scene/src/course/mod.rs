//! The MecaSim course's parameter files, and the scene that they describe.
//!
//! Reads texts: a simulation file and an object file for each object. Writes a [`crate::Scene`]
//! with one body per object. What the course leaves unused gives a warning.

mod parameter_file;
mod object;
mod simu;
mod scene;

pub use object::{ObjectIntegration, ObjectParameters};
pub use scene::{CourseObject, MecasimOptions, Viscosity, mecasim_scene};
pub use simu::{ObjectKind, SimuParameters};
