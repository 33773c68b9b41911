//! What is read from a world: fields in the user's numbering, topology, hash, step bounds.

use super::{
    body::{Body, cloth::Cloth},
    clock::World,
    setup::{
        forces::CalledForces,
        parameters::WorldParameters,
        topology::{BodyTopology, StepBound},
    },
};
use crate::{
    collide::{Collider, Pose},
    field::Field,
    math::Real,
    snow::Snow,
};

impl<R: Real> World<R> {
    pub(crate) fn particle_count(&self) -> usize {
        self.bodies.iter().map(Body::particle_count).sum()
    }

    pub(crate) fn snow_particle_count(&self) -> usize {
        self.snow().map_or(0, Snow::particle_count)
    }

    pub(crate) fn spring_count(&self) -> usize {
        self.bodies.iter().map(Body::spring_count).sum()
    }

    pub(crate) fn snow(&self) -> Option<&Snow<R>> {
        self.bodies.iter().find_map(Body::as_snow).map(|body| &body.snow)
    }

    pub(crate) fn snow_mut(&mut self) -> Option<&mut Snow<R>> {
        self.bodies.iter_mut().find_map(Body::as_snow_mut).map(|body| &mut body.snow)
    }

    pub(crate) fn wind(&self) -> [f64; 3] {
        self.around().wind
    }

    pub(crate) fn parameters(&self) -> WorldParameters {
        let cloths = self.bodies.iter().filter_map(Body::as_cloth).flat_map(Cloth::parameters);
        let mut cloths: Vec<_> = cloths.collect();
        cloths.sort_by_key(|(first_particle, _)| *first_particle);
        let time = self.time();
        let poses = self.colliders.iter().map(|collider| (collider.name.clone(), collider.pose(time)));
        WorldParameters {
            gravity: self.gravity,
            wind: self.wind(),
            cloths: cloths.into_iter().map(|(_, cloth)| cloth).collect(),
            colliders: poses.collect(),
        }
    }

    pub(crate) fn called_forces(&self, most: usize) -> Vec<CalledForces> {
        let (mut found, mut left) = (Vec::new(), most);
        self.bodies.iter().for_each(|body| body.called_forces(&mut left, &mut found));
        // Other bodies may stand between those of one cloth.
        found.sort_by_key(|(first_particle, _)| *first_particle);
        found.into_iter().map(|(_, told)| told).collect()
    }

    pub(crate) fn colliders(&self) -> &[Collider] {
        &self.colliders
    }

    pub(crate) fn collider_pose(&self, index: usize) -> Pose {
        self.colliders[index].pose(self.time())
    }

    pub(crate) fn read<T: Real>(&self, field: Field, out: &mut [T]) {
        let width = field.width();
        assert_eq!(out.len(), width * self.particle_count(), "{width} numbers per particle");
        assert!(!field.is_evaluated() || self.ranks.is_none(), "it is evaluated where all particles are");
        let around = self.around();
        for body in &self.bodies {
            body.read(field, &around, out);
        }
    }

    /// Hash (XXH3, 64 bits) of all on which further steps depend: of the steps taken, the parameters, the ways of
    /// colliders, and the wrapping sum of one XXH3 per particle, seeded with its number. Positions and velocities, and what
    /// else a body carries, are read as little-endian binary64. It runs on the rayon pool that the caller installed.
    pub fn state_hash(&self) -> u64 {
        let mut hasher = xxhash_rust::xxh3::Xxh3::new();
        hasher.update(&self.step_count.to_le_bytes());
        for number in self.gravity.into_iter().chain(self.wind.numbers()) {
            hasher.update(&number.to_le_bytes());
        }
        self.bodies.iter().for_each(|body| body.hash_parameters(&mut hasher));
        self.hash_ways(&mut hasher);
        self.pace.hash(&mut hasher);
        let particles = self.bodies.iter().map(Body::hash).fold(0, u64::wrapping_add);
        hasher.update(&particles.to_le_bytes());
        hasher.digest()
    }

    /// Adds the colliders that keys or calls move to a hash.
    fn hash_ways(&self, hasher: &mut xxhash_rust::xxh3::Xxh3) {
        let time = self.time();
        for (number, collider) in (0_u64..).zip(&self.colliders) {
            if let Some(way) = &collider.way {
                hasher.update(&number.to_le_bytes());
                way.numbers(time).for_each(|number| hasher.update(&number.to_le_bytes()));
            }
        }
    }

    pub(crate) fn topology(&self) -> Vec<BodyTopology> {
        let mut topology = Vec::new();
        self.bodies.iter().for_each(|body| body.topology(&mut topology));
        // Other bodies may stand between those of one cloth.
        topology.sort_by_key(|body| body.first_particle);
        topology
    }

    pub(crate) fn step_bounds(&self) -> Vec<StepBound> {
        let around = self.around();
        self.bodies.iter().filter_map(|body| body.step_bound(&around)).collect()
    }
}
