//! What particles hit: signed distances, and the answer of a particle that touches one.

mod collider;

pub use collider::{Collider, Shape};
