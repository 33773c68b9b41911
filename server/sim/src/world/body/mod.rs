//! A body of a world: cloth, which may be several bodies of its setup, or snow. What the world asks
//! of a body is written once, here, and answered by each kind in a file of its own.

pub(crate) mod parts;
pub(crate) mod together;
pub(crate) mod cloth;
mod rest;
mod cloth_parameters;
mod cloth_fields;
mod placed;
mod tasks;
pub(crate) mod snow;

use cloth::Cloth;
use snow::SnowBody;

use super::setup::{
    forces::{CalledForces, Forces},
    topology::{BodyTopology, StepBound},
};
use crate::{
    field::Field,
    math::Real,
    report::{Diagnostics, StepFailure},
    surroundings::Surroundings,
};

/// A body of a world.
#[derive(Clone, Debug)]
pub(crate) enum Body<R: Real> {
    /// Particles joined by springs: a cloth of the setup, or all that have a thickness.
    Cloth(Box<Cloth<R>>),
    /// Particles over a grid: all objects of snow together.
    Snow(Box<SnowBody<R>>),
}

/// The same expression on a body of either kind.
macro_rules! on_body {
    ($self:expr, $body:ident => $expression:expr) => {
        match $self {
            Body::Cloth($body) => $expression,
            Body::Snow($body) => $expression,
        }
    };
}

impl<R: Real> Body<R> {
    /// Number among all particles of one of its own.
    pub(crate) fn of_all(&self, own: u64) -> u64 {
        match self {
            Self::Cloth(cloth) => cloth.of_all(own),
            Self::Snow(snow) => u64::from(snow.first_particle) + own,
        }
    }

    /// Number of particles.
    pub(crate) fn particle_count(&self) -> usize {
        on_body!(self, body => body.particle_count())
    }

    /// Number of springs; 0 for snow.
    pub(crate) fn spring_count(&self) -> usize {
        self.as_cloth().map_or(0, Cloth::spring_count)
    }

    /// The name that a failure of a step is told under.
    pub(crate) fn name_for(&self, failure: &StepFailure) -> &str {
        on_body!(self, body => body.name_for(failure))
    }

    /// Returns to the state before the step that was taken last, or failed. Snow keeps its last good
    /// step.
    pub(crate) fn undo(&mut self) {
        if let Self::Cloth(cloth) = self {
            cloth.undo();
        }
    }

    /// Diagnostics of the state as it is.
    pub(crate) fn diagnose(&self, around: &Surroundings<'_>) -> Diagnostics {
        on_body!(self, body => body.diagnose(around))
    }

    /// Sets forces on particles of the cloth or the object of that name.
    pub(crate) fn set_forces(&mut self, name: &str, particles: &[u32], forces: &Forces) {
        on_body!(self, body => body.set_forces(name, particles, forces));
    }

    /// Adds the forces that calls have set, each with the first particle of what it acts on; so many particles as are `left` are
    /// listed.
    pub(crate) fn called_forces(&self, left: &mut usize, out: &mut Vec<(u32, CalledForces)>) {
        on_body!(self, body => body.called_forces(left, out));
    }

    /// Puts the particles of the cloth or the object of that name elsewhere (m), with these velocities (m/s).
    pub(crate) fn place(&mut self, name: &str, positions: &[[f64; 3]], velocities: Option<&[[f64; 3]]>) {
        on_body!(self, body => body.place(name, positions, velocities));
    }

    /// Memory of what changes have given it: ways of pins, forces, and pulls (bytes).
    pub(crate) fn changed_bytes(&self) -> usize {
        on_body!(self, body => body.changed_bytes())
    }

    /// Puts it back to its start.
    pub(crate) fn reset(&mut self) {
        on_body!(self, body => body.reset());
    }

    /// Writes its part of a field over `out`, which is that of all bodies, in the user's numbering.
    pub(crate) fn read<T: Real>(&self, field: Field, around: &Surroundings<'_>, out: &mut [T]) {
        on_body!(self, body => body.read(field, around, out));
    }

    /// Adds the parameters that may change to a hash, and forces and pulls that calls have set.
    pub(crate) fn hash_parameters(&self, hasher: &mut xxhash_rust::xxh3::Xxh3) {
        match self {
            Self::Cloth(cloth) => cloth.hash_parameters(hasher),
            Self::Snow(snow) => snow.hash_forces(hasher),
        }
    }

    /// Wrapping sum of hashes of the exact state, one per particle.
    pub(crate) fn hash(&self) -> u64 {
        on_body!(self, body => body.hash())
    }

    /// Adds what frames refer to: one entry per cloth or object of snow.
    pub(crate) fn topology(&self, out: &mut Vec<BodyTopology>) {
        on_body!(self, body => body.topology(out));
    }

    /// Largest explicit step; that of snow is in its report.
    pub(crate) fn step_bound(&self, around: &Surroundings<'_>) -> Option<StepBound> {
        self.as_cloth().map(|cloth| cloth.step_bound(around))
    }

    /// The cloth, if it is one.
    pub(crate) fn as_cloth(&self) -> Option<&Cloth<R>> {
        let Self::Cloth(cloth) = self else { return None };
        Some(cloth)
    }

    /// The cloth, to be changed, if it is one.
    pub(crate) fn as_cloth_mut(&mut self) -> Option<&mut Cloth<R>> {
        let Self::Cloth(cloth) = self else { return None };
        Some(cloth)
    }

    /// The snow, if it is that.
    pub(crate) fn as_snow(&self) -> Option<&SnowBody<R>> {
        let Self::Snow(snow) = self else { return None };
        Some(snow)
    }

    /// The snow, to be changed, if it is that.
    pub(crate) fn as_snow_mut(&mut self) -> Option<&mut SnowBody<R>> {
        let Self::Snow(snow) = self else { return None };
        Some(snow)
    }
}
