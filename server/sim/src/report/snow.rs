//! What a step of snow tells.

use serde::{Deserialize, Serialize};

use super::bound::TimeBound;

/// Diagnostics of snow after a step of the world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SnowReport {
    /// Number of steps of the snow within this step of the world.
    pub substeps: u32,
    /// Length of the last of them (s).
    pub dt: f64,
    /// The bound on the next one.
    pub bound: TimeBound,
    /// Mass of all particles (kg).
    pub mass: f64,
    /// Mass on the grid over mass of the particles, minus 1, in the last of the steps.
    pub grid_mass_error: f64,
    /// Number of particles that yielded in the last of the steps.
    pub plastic_count: u64,
    /// Number of particles with det F < 0 before plastic return, or J_P <= 0 after it.
    pub inverted_count: u64,
    /// Number of particles whose J_P was held at an end of its range.
    pub clamped_count: u64,
    /// Number of particles that are ballistic: nearly alone on the grid.
    pub ballistic_count: u64,
    /// Number of particles that are stretched farther than the cells of the grid can bear: they tear by numerics alone.
    pub torn_count: u64,
    /// Smallest and largest plastic ratio J_P of all particles.
    pub plastic_ratio_range: [f64; 2],
    /// Speed of the fastest particle (m/s).
    pub max_speed: f64,
    /// Momentum (kg m/s) of nodes too light to carry a velocity, left out in the last of the steps.
    pub dropped_momentum: f64,
    /// Angular momentum about the origin (kg m²/s), affine part included.
    pub angular_momentum: [f64; 3],
    /// Number of blocks of 4 x 4 x 4 nodes in use.
    pub block_count: u64,
}

impl SnowReport {
    /// The same with particles numbered over all bodies, of which `first` is the snow's first.
    pub(crate) fn shifted(mut self, first: u64) -> Self {
        self.bound.particle = self.bound.particle.map(|particle| particle + first);
        self
    }
}
