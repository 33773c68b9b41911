//! Cloth: particles joined by springs.

mod integrate;
mod network;
mod settings;

pub use integrate::Integrator;
pub use network::{Network, Spring, SpringKind, SpringLaw, SpringRules};
pub use settings::{ClothSettings, Hessian, StateLimits};
