//! Changes between two steps: all of a list are applied, or none.

use thiserror::Error;

use super::World;
use crate::{
    cloth::{PinMotion, SpringKind},
    math::Real,
    snow::Snow,
};

/// A change between two steps. Particles are in the user's numbering, over all bodies.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// Gravity (m/s²).
    Gravity([f64; 3]),
    /// Velocity of the medium (m/s).
    Wind([f64; 3]),
    /// Linear drag of the medium on every particle (N s/m).
    Drag(f64),
    /// Stiffness (N/m) and damping (N s/m) of springs; `None` leaves one as it is.
    Springs {
        /// Body; `None`: all.
        body: Option<String>,
        /// Kind; `None`: all.
        kind: Option<SpringKind>,
        /// New stiffness (N/m).
        stiffness: Option<f64>,
        /// New damping (N s/m).
        damping: Option<f64>,
    },
    /// Moves a pinned particle to `target` (m) within `duration` (s), at constant speed.
    Pin {
        /// Particle.
        particle: u32,
        /// Target (m).
        target: [f64; 3],
        /// Duration (s), rounded up to one step.
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
                // Particles of snow are found in no body: none of them is pinned.
                let found = self.find(*particle);
                let pinned = found
                    .is_some_and(|(body, place)| self.bodies[body].model.inv_m[place as usize] == R::zero());
                if pinned { Ok(()) } else { Err(ChangeError::NotPinned { particle: *particle }) }
            }
        }
    }

    fn check_springs(&self, name: Option<&str>, kind: Option<SpringKind>) -> Result<(), ChangeError> {
        let is_snow =
            |name: &&str| self.snow.iter().flat_map(Snow::objects).any(|(object, _)| object == *name);
        if let Some(name) = name.filter(is_snow) {
            return Err(ChangeError::SnowHasNoSprings { name: name.into() });
        }
        if self.bodies.is_empty() {
            return Err(ChangeError::NoCloth);
        }
        let named = |body: &&super::Body<R>| name.is_none_or(|name| body.name == name);
        let has_kind =
            |body: &super::Body<R>| body.parameters.laws.iter().any(|law| kind.is_none_or(|k| law.kind == k));
        let mut bodies = self.bodies.iter().filter(named).peekable();
        if bodies.peek().is_none() {
            let known = self.bodies.iter().map(|body| body.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(ChangeError::UnknownBody { name: name.unwrap_or_default().into(), known });
        }
        if bodies.any(has_kind) {
            return Ok(());
        }
        let kind = kind.map_or("any", SpringKind::name);
        Err(ChangeError::NoSuchSprings { body: name.unwrap_or("any").into(), kind })
    }

    fn apply_one(&mut self, change: &Change) {
        match change {
            Change::Gravity(value) => self.gravity = *value,
            Change::Wind(value) => self.wind = *value,
            Change::Drag(value) => self.bodies.iter_mut().for_each(|body| body.parameters.drag = *value),
            Change::Springs { body: name, kind, stiffness, damping } => {
                let bodies =
                    self.bodies.iter_mut().filter(|body| name.as_ref().is_none_or(|name| body.name == *name));
                let laws = bodies.flat_map(|body| &mut body.parameters.laws);
                for entry in laws.filter(|entry| kind.is_none_or(|kind| entry.kind == kind)) {
                    entry.law.stiffness = stiffness.unwrap_or(entry.law.stiffness);
                    entry.law.damping = damping.unwrap_or(entry.law.damping);
                }
            }
            Change::Pin { particle, target, duration } => self.send_pin(*particle, *target, *duration),
        }
    }

    fn send_pin(&mut self, particle: u32, target: [f64; 3], duration: f64) {
        let Some((body, place)) = self.find(particle) else { return };
        let body = &mut self.bodies[body];
        let dt = self.dt / f64::from(body.settings.substeps);
        // A duration of a whole number of steps stays one when the quotient is rounded.
        let steps_left = ((duration / dt - 1e-9).ceil() as u64).max(u64::from(body.settings.substeps));
        body.state.motions.retain(|motion| motion.particle != place);
        body.state.motions.push(PinMotion { particle: place, target, steps_left });
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
