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
    /// What acts on each particle at the state as it is, contacts left out (N), x y z per particle; also on pins.
    Forces,
    /// The same over the mass of each particle (m/s²); 0 for pins.
    Accelerations,
}

impl Field {
    /// All of them, in the order of the contract.
    pub const ALL: [Self; 6] = [
        Self::Positions,
        Self::Velocities,
        Self::PlasticRatios,
        Self::StressNorms,
        Self::Forces,
        Self::Accelerations,
    ];

    /// Numbers per particle.
    pub const fn width(self) -> usize {
        match self {
            Self::Positions | Self::Velocities | Self::Forces | Self::Accelerations => 3,
            Self::PlasticRatios | Self::StressNorms => 1,
        }
    }

    /// Whether it is evaluated when it is read, and no part of the state.
    pub const fn is_evaluated(self) -> bool {
        matches!(self, Self::Forces | Self::Accelerations)
    }
}
