//! How much of the cloth of a world lies still.

use serde::{Deserialize, Serialize};

/// Why cloth that slept is awake.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum WakeCause {
    /// A call changed it, or what surrounds it.
    Call,
    /// A force began or ended to act on it, or it is pulled.
    Force,
    /// The wind that it feels changed.
    Wind,
    /// One of its pins is on its way.
    Pin,
    /// A collider that moves came within reach of it.
    Collider,
    /// A long step found that it moves.
    Motion,
    /// What is told of its error came above that of the scene: it stays awake.
    Error,
}

/// When cloth woke last, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Wake {
    /// Steps of the scene that were taken before.
    pub step: u64,
    /// What woke it.
    pub cause: WakeCause,
}

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
    /// Particles that sleep.
    pub particles_asleep: u64,
    /// Pieces that sleep.
    pub pieces_asleep: u64,
    /// An estimate of how far off positions are since cloth slept (m), of the cloth that is off most.
    pub told: f64,
    /// Long steps that cloth has taken since its beginning.
    pub long_steps: u64,
    /// How often cloth was woken since its beginning.
    pub wakes: u64,
    /// The last time that any was; none where none was.
    pub wake: Option<Wake>,
}

impl RestReport {
    /// The share of the particles that are in calm pieces, from 0 to 1.
    pub fn calm_share(&self) -> f64 {
        self.calm_particles as f64 / self.particles.max(1) as f64
    }

    /// The share of the particles that are awake, from 0 to 1; 1 without particles.
    pub fn awake_share(&self) -> f64 {
        1.0 - self.particles_asleep as f64 / self.particles.max(1) as f64
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
            particles_asleep: self.particles_asleep + other.particles_asleep,
            pieces_asleep: self.pieces_asleep + other.pieces_asleep,
            told: self.told.max(other.told),
            long_steps: self.long_steps + other.long_steps,
            wakes: self.wakes + other.wakes,
            wake: self.wake.into_iter().chain(other.wake).max_by_key(|wake| wake.step),
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
            particles_asleep: 3,
            pieces_asleep: 1,
            told: 1e-5,
            long_steps: 4,
            wakes: 1,
            wake: Some(Wake { step: 7, cause: WakeCause::Pin }),
        };
        let later = Some(Wake { step: 9, cause: WakeCause::Call });
        let other = RestReport {
            particles: 5,
            pieces: 2,
            way: 0.1,
            told: 1e-6,
            long_steps: 2,
            wakes: 3,
            wake: later,
            ..RestReport::default()
        };
        let both = RestReport {
            particles: 8,
            calm_particles: 3,
            pieces: 3,
            calm_pieces: 1,
            way: 0.1,
            change: 1e-7,
            particles_asleep: 3,
            pieces_asleep: 1,
            told: 1e-5,
            long_steps: 6,
            wakes: 4,
            wake: later,
        };
        assert_eq!([one.with(other), other.with(one)], [both; 2]);
        assert_eq!([one, other, both].map(|told| told.awake_share()), [0.0, 1.0, 0.625]);
        assert_eq!([one, other, both].map(|told| told.calm_share()), [1.0, 0.0, 0.375]);
        assert_eq!(RestReport::default().calm_share(), 0.0);
    }
}
