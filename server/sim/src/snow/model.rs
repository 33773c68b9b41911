//! What never changes of snow during a run.

use super::{attached::Attached, law::MaterialConstants, settings::SnowSettings};
use crate::math::Real;

/// What never changes during a run. Volumes at rest, factors on the stiffness and objects do not
/// either, but change their places with the particles, and are kept with them.
#[derive(Clone, Debug)]
pub struct SnowModel<R: Real> {
    pub(super) settings: SnowSettings,
    /// The material of each object.
    pub(super) materials: Vec<MaterialConstants<R>>,
    /// Name and particle count of each object.
    pub(super) objects: Vec<(String, usize)>,
    /// Mass of all particles (kg).
    pub(super) mass: f64,
    /// Mass of the lightest particle (kg).
    pub(super) least_mass: f64,
    /// Particles that are held to colliders.
    pub(super) attached: Attached<R>,
}

impl<R: Real> SnowModel<R> {
    /// How it is stepped.
    pub fn settings(&self) -> &SnowSettings {
        &self.settings
    }

    /// Names and particle counts of the objects, in order.
    pub fn objects(&self) -> impl Iterator<Item = (&str, usize)> {
        self.objects.iter().map(|(name, count)| (name.as_str(), *count))
    }

    /// Name of the object that a particle, in the user's numbering, belongs to.
    pub fn object_of(&self, particle: u64) -> &str {
        let mut end = 0;
        let found = self.objects.iter().find(|(_, count)| {
            end += *count as u64;
            particle < end
        });
        found.map_or("snow", |(name, _)| name)
    }
}
