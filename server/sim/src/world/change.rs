//! Changes between two steps: all of a list are applied, or none.

use thiserror::Error;

use super::{body::Body, clock::World, cloth::Cloth};
use crate::{cloth::SpringKind, math::Real};

/// A change between two steps. Particles are in the user's numbering, over all bodies.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// New gravity of the world (m/s²).
    Gravity([f64; 3]),
    /// New velocity of the medium (m/s).
    Wind([f64; 3]),
    /// New linear drag of the medium on every particle of cloth (N s/m), 0 or more.
    Drag(f64),
    /// Stiffness (N/m) and damping (N s/m) of springs; `None` leaves one as it is.
    Springs {
        /// Name of the cloth; `None`: all cloths.
        body: Option<String>,
        /// Kind of spring; `None`: all kinds.
        kind: Option<SpringKind>,
        /// New stiffness (N/m), 0 or more.
        stiffness: Option<f64>,
        /// New damping (N s/m), 0 or more.
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

/// A change that was refused; nothing was changed.
#[derive(Clone, Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ChangeError {
    #[error("{field} is {value}: {allowed}")]
    OutOfRange { field: &'static str, value: f64, allowed: &'static str },
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
            Change::Gravity(value) => finite("gravity", value),
            Change::Wind(value) => finite("wind", value),
            Change::Drag(value) => not_negative("drag", *value),
            Change::Springs { body, kind, stiffness, damping } => {
                stiffness.map_or(Ok(()), |value| not_negative("stiffness", value))?;
                damping.map_or(Ok(()), |value| not_negative("damping", value))?;
                self.check_springs(body.as_deref(), *kind)
            }
            Change::Pin { particle, target, duration } => {
                finite("target", target)?;
                not_negative("duration", *duration)?;
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

fn finite(field: &'static str, value: &[f64; 3]) -> Result<(), ChangeError> {
    let allowed = "finite components are needed";
    value
        .iter()
        .find(|c| !c.is_finite())
        .map_or(Ok(()), |&value| Err(ChangeError::OutOfRange { field, value, allowed }))
}

fn not_negative(field: &'static str, value: f64) -> Result<(), ChangeError> {
    let allowed = "a finite number from 0 is needed";
    if value.is_finite() && value >= 0.0 {
        Ok(())
    } else {
        Err(ChangeError::OutOfRange { field, value, allowed })
    }
}
