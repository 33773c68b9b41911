//! The law of snow: materials, plastic return, stress and its change (Stomakhin et al. 2013, section 5).

pub(super) mod material;
pub(super) mod constitutive;
pub(super) mod deform;
pub(super) mod tangent;
pub mod constitutive_scalar;
