//! What particles hit: signed distances, and the answer of a particle that touches one.

pub mod shape;
mod collider;
mod contact;
mod velocity;

pub use collider::{Collider, Contact};
pub use shape::Shape;

pub(crate) use contact::{Contacts, Met, Passed, resolve};
pub(crate) use velocity::velocity_after;
