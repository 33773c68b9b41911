//! Snow as a body of a world: built from a setup, stepped, looked at, restored.

use super::{GridNode, ParticleState, SnowError, SnowSettings, SnowSetup};
use crate::{
    collide::Collider,
    math::Real,
    report::{Diagnostics, SnowReport, StepFailure, Stopwatch},
};

/// What surrounds snow during one step of the world.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// Gravity (m/s²).
    pub gravity: [f64; 3],
    /// What particles hit.
    pub colliders: &'a [Collider],
    /// Time at the start of the step (s).
    pub time: f64,
    /// The world's time step (s); snow divides it into its own.
    pub dt: f64,
}

/// Snow: the particles of all objects on one grid.
#[derive(Debug)]
pub struct Snow<R: Real> {
    setup: SnowSetup,
    marker: std::marker::PhantomData<R>,
}

impl<R: Real> Snow<R> {
    /// Builds snow; the strings are remarks that do not stop it.
    ///
    /// # Errors
    /// What is wrong with the setup.
    pub fn new(setup: &SnowSetup) -> Result<(Self, Vec<String>), SnowError> {
        Ok((Self { setup: setup.clone(), marker: std::marker::PhantomData }, Vec::new()))
    }

    /// Advances by one step of the world, in as many steps of the snow as the bound asks for.
    ///
    /// # Errors
    /// When a step of the snow cannot be taken: the state is then the one before it.
    pub fn step(
        &mut self,
        _around: &Surroundings<'_>,
        _watch: &mut impl Stopwatch,
    ) -> Result<(Diagnostics, SnowReport, u64), StepFailure> {
        unreachable!()
    }

    /// Particles.
    pub fn particle_count(&self) -> usize {
        self.setup.objects.iter().map(|object| object.x.len()).sum()
    }

    /// Particles in the user's numbering.
    pub fn particles(&self) -> Vec<ParticleState> {
        Vec::new()
    }

    /// Puts particles, in the user's numbering, in place of those that are there.
    pub fn restore(&mut self, _particles: &[ParticleState]) {}

    /// Adds `dv(particle, x, v)` (m/s) to the velocity of each particle.
    pub fn kick(&mut self, _dv: impl Fn(u32, [f64; 3], [f64; 3]) -> [f64; 3] + Sync) {}

    /// Nodes with mass as the last step left them; clears `out` first.
    pub fn grid_nodes(&self, out: &mut Vec<GridNode>) {
        out.clear();
    }

    /// Plastic volume ratios in the user's numbering, added to `out`.
    pub fn plastic_ratios<T>(&self, _out: &mut Vec<T>, _convert: impl Fn(R) -> T) {}

    /// Frobenius norms of the Cauchy stress (Pa) in the user's numbering, added to `out`.
    pub fn stress_norms<T>(&self, _out: &mut Vec<T>, _convert: impl Fn(R) -> T) {}

    /// How it is stepped.
    pub fn settings(&self) -> &SnowSettings {
        &self.setup.settings
    }

    /// Names and particle counts of the objects, in order.
    pub fn objects(&self) -> impl Iterator<Item = (&str, usize)> {
        self.setup.objects.iter().map(|object| (object.name.as_str(), object.x.len()))
    }

    /// Name of the object that a particle belongs to.
    pub fn object_of(&self, particle: u64) -> &str {
        let mut end = 0;
        let mut found = self.objects().find(|(_, count)| {
            end += *count as u64;
            particle < end
        });
        found.take().map_or("snow", |(name, _)| name)
    }

    /// Positions (m), x y z a particle, in the user's numbering, added to `out`.
    pub fn positions<T>(&self, _out: &mut Vec<T>, _convert: impl Fn(R) -> T) {}

    /// Velocities (m/s), likewise.
    pub fn velocities<T>(&self, _out: &mut Vec<T>, _convert: impl Fn(R) -> T) {}

    /// Adds the exact state to a hash, in the user's numbering.
    pub(crate) fn hash_into(&self, _hasher: &mut xxhash_rust::xxh3::Xxh3) {}

    /// Figures of the state as it is.
    pub fn diagnose(&self, _gravity: [f64; 3]) -> Diagnostics {
        Diagnostics::default()
    }
}
