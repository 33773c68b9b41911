//! A network laid out for kernels: rows of particles in blocks, sixteen springs, elements or triangles side by side.
//!
//! Enters: a network, or several that are one cloth. Leaves: a model, which steps only read. Modules in reading order:

mod halo;
mod ahead;
mod rows;
mod scratch;
mod lists;
mod elements;
mod triangles;
mod surface;
mod figures;
mod parts;
mod check;
mod model;

pub(crate) use check::check_network;
pub(super) use elements::{BlockOfRows, ElementFigures, ElementNumbers, Elements};
pub(super) use figures::{Figure, Yield};
pub(super) use halo::copy_own;
pub use model::{LawEntry, Model, Parameters};
pub(super) use parts::{Part, Pushed};
pub use rows::Springs;
pub(super) use rows::{Fold, Visit};
pub(super) use scratch::{BlockScratch, Scratches};
pub(super) use surface::Surface;
pub(super) use triangles::{OfTriangle, Triangles};
