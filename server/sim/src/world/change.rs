//! Changes between two steps: all of a list are applied, or none.

use thiserror::Error;

use super::{body::Body, clock::World, cloth::Cloth};
use crate::{cloth::SpringKind, math::Real};

/// A change between two steps, its numbers within [`allowed`]. Particles are in the user's numbering, over all
/// bodies.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// New gravity of the world (m/s²).
    Gravity([f64; 3]),
    /// New velocity of the medium (m/s).
    Wind([f64; 3]),
    /// New linear drag of the medium on every particle of cloth (N s/m).
    Drag(f64),
    /// Stiffness (N/m) and damping (N s/m) of springs; `None` leaves one as it is.
    Springs {
        /// Name of the cloth; `None`: all cloths.
        body: Option<String>,
        /// Kind of spring; `None`: all kinds.
        kind: Option<SpringKind>,
        /// New stiffness (N/m).
        stiffness: Option<f64>,
        /// New damping (N s/m).
        damping: Option<f64>,
    },
    /// Moves a pinned particle to `target` (m) within `duration` (s), at constant speed.
    Pin {
        /// Number of the particle over all bodies, from 0.
        particle: u32,
        /// Position at which it arrives (m).
        target: [f64; 3],
        /// Time that it takes (s), one step at least.
        duration: f64,
    },
}

/// Numbers that changes and scenes allow, both ends included.
pub mod allowed {
    /// Components of gravity (m/s²).
    pub const GRAVITY: [f64; 2] = [-1e4, 1e4];
    /// Components of a velocity (m/s).
    pub const SPEED: [f64; 2] = [-1e4, 1e4];
    /// Drag of a particle (N s/m).
    pub const DRAG: [f64; 2] = [0.0, 1e9];
    /// Stiffness of a spring (N/m).
    pub const STIFFNESS: [f64; 2] = [0.0, 1e12];
    /// Damping of a spring (N s/m).
    pub const DAMPING: [f64; 2] = [0.0, 1e9];
    /// Coordinates (m).
    pub const LENGTH: [f64; 2] = [-1e6, 1e6];
    /// Time that a pin takes (s).
    pub const DURATION: [f64; 2] = [0.0, 1e9];
}

/// A change that was refused; nothing was changed.
#[derive(Clone, Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ChangeError {
    #[error("{field} is {value:e}: allowed are {low:e} to {high:e}", low = allowed[0], high = allowed[1])]
    OutOfRange { field: &'static str, value: f64, allowed: [f64; 2] },
    #[error("no body is named '{name}'; there are: {known}")]
    UnknownBody { name: String, known: String },
    #[error("body '{body}' has no {kind} springs")]
    NoSuchSprings { body: String, kind: &'static str },
    #[error("'{name}' is snow, which has no springs")]
    SnowHasNoSprings { name: String },
    #[error("there are no springs to change: there is no cloth")]
    NoCloth,
    #[error("particle {particle} is not pinned")]
    NotPinned { particle: u32 },
    #[error("there is no particle {particle}: there are {count}, from 0")]
    NoSuchParticle { particle: u32, count: usize },
}

impl<R: Real> World<R> {
    /// Checks changes without applying them.
    ///
    /// # Errors
    /// The first change that would be refused.
    pub fn check(&self, changes: &[Change]) -> Result<(), ChangeError> {
        changes.iter().try_for_each(|change| self.check_one(change))
    }

    /// Applies changes, all or none.
    ///
    /// # Errors
    /// The first change that is refused.
    pub fn apply(&mut self, changes: &[Change]) -> Result<(), ChangeError> {
        self.check(changes)?;
        for change in changes {
            self.apply_one(change);
        }

        Ok(())
    }

    fn check_one(&self, change: &Change) -> Result<(), ChangeError> {
        match change {
            Change::Gravity(value) => within("gravity", value, allowed::GRAVITY),
            Change::Wind(value) => within("wind", value, allowed::SPEED),
            Change::Drag(value) => within("drag", &[*value], allowed::DRAG),
            Change::Springs { body, kind, stiffness, damping } => {
                within("stiffness", stiffness.as_slice(), allowed::STIFFNESS)?;
                within("damping", damping.as_slice(), allowed::DAMPING)?;
                self.check_springs(body.as_deref(), *kind)
            }
            Change::Pin { particle, target, duration } => {
                within("target", target, allowed::LENGTH)?;
                within("duration", &[*duration], allowed::DURATION)?;
                let count = self.particle_count();
                if *particle as usize >= count {
                    return Err(ChangeError::NoSuchParticle { particle: *particle, count });
                }

                let (body, own) = self.find(*particle);
                if self.bodies[body].is_pinned(own) {
                    Ok(())
                } else {
                    Err(ChangeError::NotPinned { particle: *particle })
                }
            }
        }
    }

    fn check_springs(&self, name: Option<&str>, kind: Option<SpringKind>) -> Result<(), ChangeError> {
        let is_snow =
            |name: &&str| self.snow().is_some_and(|snow| snow.objects().any(|(object, _)| object == *name));
        if let Some(name) = name.filter(is_snow) {
            return Err(ChangeError::SnowHasNoSprings { name: name.into() });
        }
        if self.cloths().next().is_none() {
            return Err(ChangeError::NoCloth);
        }

        let named = |cloth: &&Cloth<R>| name.is_none_or(|name| cloth.name == name);
        let mut found = self.cloths().filter(named).peekable();
        if found.peek().is_none() {
            let known = self.cloths().map(|cloth| cloth.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(ChangeError::UnknownBody { name: name.unwrap_or_default().into(), known });
        }

        if found.any(|cloth| cloth.has_springs(kind)) {
            return Ok(());
        }

        let kind = kind.map_or("any", SpringKind::name);
        Err(ChangeError::NoSuchSprings { body: name.unwrap_or("any").into(), kind })
    }

    fn apply_one(&mut self, change: &Change) {
        match change {
            Change::Gravity(value) => self.gravity = *value,
            Change::Wind(value) => self.wind = *value,
            Change::Drag(value) => self.cloths_mut().for_each(|cloth| cloth.set_drag(*value)),
            Change::Springs { body: name, kind, stiffness, damping } => {
                let named = |cloth: &&mut Cloth<R>| name.as_ref().is_none_or(|name| cloth.name == *name);
                let cloths = self.cloths_mut().filter(named);
                cloths.for_each(|cloth| cloth.set_springs(*kind, *stiffness, *damping));
            }
            Change::Pin { particle, target, duration } => {
                let (body, own) = self.find(*particle);
                if let Some(cloth) = self.bodies[body].as_cloth_mut() {
                    cloth.send_pin(own, *target, *duration, self.dt);
                }
            }
        }
    }

    fn cloths(&self) -> impl Iterator<Item = &Cloth<R>> {
        self.bodies.iter().filter_map(Body::as_cloth)
    }

    fn cloths_mut(&mut self) -> impl Iterator<Item = &mut Cloth<R>> {
        self.bodies.iter_mut().filter_map(Body::as_cloth_mut)
    }

    /// The body of a user's particle, and its number there.
    fn find(&self, particle: u32) -> (usize, u32) {
        let body = self.bodies.partition_point(|body| body.first_particle() <= particle) - 1;
        (body, particle - self.bodies[body].first_particle())
    }
}

fn within(field: &'static str, values: &[f64], allowed: [f64; 2]) -> Result<(), ChangeError> {
    let [low, high] = allowed;
    let wrong = values.iter().find(|value| !(low..=high).contains(*value));
    wrong.map_or(Ok(()), |&value| Err(ChangeError::OutOfRange { field, value, allowed }))
}
