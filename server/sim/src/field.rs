//! Fields: arrays over the particles of a world, which frames show.

use serde::{Deserialize, Serialize};

/// An array over the particles of a world, in the user's numbering.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Field {
    /// Positions (m), x y z per particle.
    Positions,
    /// Velocities (m/s), x y z per particle.
    Velocities,
    /// Plastic volume ratios J_P, one per particle; 1 for cloth.
    PlasticRatios,
    /// Frobenius norms of the Cauchy stress (Pa), one per particle; 0 for cloth.
    StressNorms,
}

impl Field {
    /// All of them, in the order of the contract.
    pub const ALL: [Self; 4] = [Self::Positions, Self::Velocities, Self::PlasticRatios, Self::StressNorms];

    /// Numbers per particle.
    pub const fn width(self) -> usize {
        match self {
            Self::Positions | Self::Velocities => 3,
            Self::PlasticRatios | Self::StressNorms => 1,
        }
    }
}
