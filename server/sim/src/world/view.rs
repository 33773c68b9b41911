//! What is read from a world: positions in the user's numbering, topology, hash, step bounds.

use super::{
    body::Body,
    clock::World,
    cloth::Cloth,
    parameters::WorldParameters,
    topology::{BodyTopology, StepBound},
};
use crate::{collide::Collider, math::Real, snow::Snow};

impl<R: Real> World<R> {
    /// Number of particles of all bodies.
    pub fn particle_count(&self) -> usize {
        self.bodies.iter().map(Body::particle_count).sum()
    }

    /// Number of particles of snow: the last ones.
    pub fn snow_particle_count(&self) -> usize {
        self.snow().map_or(0, Snow::particle_count)
    }

    /// Number of springs of all bodies.
    pub fn spring_count(&self) -> usize {
        self.bodies.iter().map(Body::spring_count).sum()
    }

    /// The snow; none in a world of cloths alone.
    pub fn snow(&self) -> Option<&Snow<R>> {
        self.bodies.iter().find_map(Body::as_snow).map(|body| &body.snow)
    }

    /// The snow, to be changed.
    pub fn snow_mut(&mut self) -> Option<&mut Snow<R>> {
        self.bodies.iter_mut().find_map(Body::as_snow_mut).map(|body| &mut body.snow)
    }

    /// Parameters as they are now.
    pub fn parameters(&self) -> WorldParameters {
        let cloths = self.bodies.iter().filter_map(Body::as_cloth).map(Cloth::parameters).collect();
        WorldParameters { gravity: self.gravity, wind: self.wind, cloths }
    }

    /// What particles hit.
    pub fn colliders(&self) -> &[Collider] {
        &self.colliders
    }

    /// Positions (m), x y z per particle, in the user's numbering. Clears `out` first.
    pub fn positions<T: Clone>(&self, out: &mut Vec<T>, convert: impl Fn(R) -> T) {
        out.clear();
        out.reserve(3 * self.particle_count());
        self.bodies.iter().for_each(|body| body.positions(out, &convert));
    }

    /// Velocities (m/s), x y z per particle, in the user's numbering. Clears `out` first.
    pub fn velocities<T: Clone>(&self, out: &mut Vec<T>, convert: impl Fn(R) -> T) {
        out.clear();
        out.reserve(3 * self.particle_count());
        self.bodies.iter().for_each(|body| body.velocities(out, &convert));
    }

    /// Plastic volume ratios, one per particle; 1 for cloth. Clears `out` first.
    pub fn plastic_ratios<T: Clone>(&self, out: &mut Vec<T>, convert: impl Fn(R) -> T) {
        out.clear();
        out.reserve(self.particle_count());
        self.bodies.iter().for_each(|body| body.plastic_ratios(out, &convert));
    }

    /// Frobenius norms of the Cauchy stress (Pa), one per particle; 0 for cloth. Clears `out` first.
    pub fn stress_norms<T: Clone>(&self, out: &mut Vec<T>, convert: impl Fn(R) -> T) {
        out.clear();
        out.reserve(self.particle_count());
        self.bodies.iter().for_each(|body| body.stress_norms(out, &convert));
    }

    /// Hash (XXH3, 64 bits) of the steps taken and of the exact state: positions and velocities, and
    /// what else snow carries, as little-endian binary64 in the user's numbering.
    pub fn state_hash(&self) -> u64 {
        let mut hasher = xxhash_rust::xxh3::Xxh3::new();
        hasher.update(&self.step_count.to_le_bytes());
        self.bodies.iter().for_each(|body| body.hash_into(&mut hasher));
        hasher.digest()
    }

    /// What frames refer to.
    pub fn topology(&self) -> Vec<BodyTopology> {
        let mut topology = Vec::new();
        self.bodies.iter().for_each(|body| body.topology(&mut topology));
        topology
    }

    /// Largest explicit steps, one per cloth; that of snow is in its report.
    pub fn step_bounds(&self) -> Vec<StepBound> {
        self.bodies.iter().filter_map(Body::step_bound).collect()
    }
}
