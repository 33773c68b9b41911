//! What a step of snow tells.

/// A bound on the time step of snow, by name: docs/laws/snow.md derives each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum BoundKind {
    /// The elastic wave, hardening included, crosses a share of a cell per step.
    ElasticWave,
    /// A particle alone on its nodes is an oscillator: dt < 2 / omega.
    IsolatedParticle,
    /// A particle stays within half a cell.
    ParticleSpeed,
    /// I + dt grad v keeps its orientation.
    VelocityGradient,
    /// A collider moves by half a cell at most.
    ColliderSpeed,
    /// The step that the scene fixes is below every bound.
    Fixed,
    /// What is left of the world's step is below every bound.
    Frame,
}

impl BoundKind {
    /// Every kind, those of the state first.
    pub const ALL: [Self; 7] = [
        Self::ElasticWave,
        Self::IsolatedParticle,
        Self::ParticleSpeed,
        Self::VelocityGradient,
        Self::ColliderSpeed,
        Self::Fixed,
        Self::Frame,
    ];

    /// Its name in reports and on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::ElasticWave => "elastic_wave",
            Self::IsolatedParticle => "isolated_particle",
            Self::ParticleSpeed => "particle_speed",
            Self::VelocityGradient => "velocity_gradient",
            Self::ColliderSpeed => "collider_speed",
            Self::Fixed => "fixed",
            Self::Frame => "frame",
        }
    }
}

/// The bound that binds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeBound {
    /// Which bound it is.
    pub kind: BoundKind,
    /// Largest dt (s) that it allows, safety included.
    pub dt: f64,
    /// The particle that sets it, over all particles of the world; none for colliders and frames.
    pub particle: Option<u64>,
}

/// Diagnostics of snow after a step of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
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
