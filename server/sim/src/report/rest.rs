//! How much of the cloth of a world lies still.

use serde::{Deserialize, Serialize};

/// What watching for rest tells, over all cloths that are watched. A piece is what springs and elements hold together; a window is
/// eight steps of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct RestReport {
    /// Particles that are watched.
    pub particles: u64,
    /// Those of them that are in calm pieces.
    pub calm_particles: u64,
    /// Pieces that are watched.
    pub pieces: u64,
    /// Those of them that are calm.
    pub calm_pieces: u64,
    /// The farthest that a particle was from where it began the last whole window (m); 0 before there was one.
    pub way: f64,
    /// Half of the largest change of a particle's way within the last whole window from that within the one before (m); 0 before
    /// there was one.
    pub change: f64,
}

impl RestReport {
    /// The share of the particles that are in calm pieces, from 0 to 1.
    pub fn calm_share(&self) -> f64 {
        self.calm_particles as f64 / self.particles.max(1) as f64
    }

    /// This and the report of another cloth in the same step.
    #[must_use]
    pub(crate) fn with(self, other: Self) -> Self {
        Self {
            particles: self.particles + other.particles,
            calm_particles: self.calm_particles + other.calm_particles,
            pieces: self.pieces + other.pieces,
            calm_pieces: self.calm_pieces + other.calm_pieces,
            way: self.way.max(other.way),
            change: self.change.max(other.change),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_cloths_particles_add_up_and_the_liveliest_counts() {
        let one = RestReport {
            particles: 3,
            calm_particles: 3,
            pieces: 1,
            calm_pieces: 1,
            way: 1e-6,
            change: 1e-7,
        };
        let other =
            RestReport { particles: 5, calm_particles: 0, pieces: 2, calm_pieces: 0, way: 0.1, change: 0.0 };
        let both =
            RestReport { particles: 8, calm_particles: 3, pieces: 3, calm_pieces: 1, way: 0.1, change: 1e-7 };
        assert_eq!(one.with(other), both);
        assert_eq!([one, other, both].map(|told| told.calm_share()), [1.0, 0.0, 0.375]);
        assert_eq!(RestReport::default().calm_share(), 0.0);
    }
}
