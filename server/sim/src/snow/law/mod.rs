//! The law of snow: materials, plastic return, stress and its change (Stomakhin et al. 2013, section 5).

mod material;
mod constitutive;
mod deform;
mod tangent;
pub mod constitutive_scalar;

pub use material::{Law, Material, Plasticity, Preset};

pub(super) use constitutive::{MaterialConstants, Moduli, energy_density, hardened};
pub(super) use deform::{Deformed, deform, predict, product, stiffness_of, undeformed};
pub(super) use tangent::piola_change;
