//! What snow is built from, in binary64 and the user's numbering.

use thiserror::Error;

use super::{Material, SnowSettings};

/// An object of snow: particles of one material. Objects share the grid and so collide.
#[derive(Clone, Debug, PartialEq)]
pub struct SnowObject {
    /// Name, unique among all bodies of the world.
    pub name: String,
    /// Positions (m).
    pub x: Vec<[f64; 3]>,
    /// Velocities (m/s), as many.
    pub v: Vec<[f64; 3]>,
    /// Masses (kg), as many, above 0.
    pub mass: Vec<f64>,
    /// Volumes at rest (m³), as many, above 0; empty: from the density on the grid before the
    /// first step (Stomakhin et al. 2013, step 2).
    pub volume: Vec<f64>,
    /// Factors on Young's modulus, as many, above 0; empty: 1.
    pub stiffness: Vec<f64>,
    /// Material.
    pub material: Material,
}

/// Snow: objects on one grid.
#[derive(Clone, Debug, PartialEq)]
pub struct SnowSetup {
    /// Objects, at least one.
    pub objects: Vec<SnowObject>,
    /// How they are stepped.
    pub settings: SnowSettings,
}

/// Snow that cannot be built.
#[derive(Clone, Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum SnowError {
    #[error("snow: {0}")]
    Settings(String),
    #[error("snow '{object}': {message}")]
    Object { object: String, message: String },
}
