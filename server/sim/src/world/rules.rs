//! Changes between two steps, and which of them a world accepts.
//!
//! Bodies, kinds of springs and pins never change, so that changes can be checked while the world steps.

use serde::{Deserialize, Serialize};

use std::sync::Arc;

use thiserror::Error;

use super::body::Body;
use crate::{
    cloth::{Air, SpringKind},
    math::{Real, number},
};

/// A change between two steps, its numbers within [`allowed`]. Particles are in the user's numbering, over all
/// bodies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Change {
    /// New gravity of the world (m/s²).
    Gravity([f64; 3]),
    /// New velocity of the medium (m/s).
    Wind([f64; 3]),
    /// New linear drag of the medium on every particle of cloth (N s/m).
    Drag(f64),
    /// The air around a cloth that feels it; `None` leaves a number as it is.
    Air {
        /// Name of the cloth; `None`: all that feel air.
        body: Option<String>,
        /// New density (kg/m³).
        density: Option<f64>,
        /// New coefficients, see [`Air`](crate::cloth::Air).
        normal: Option<f64>,
        #[allow(missing_docs, reason = "see above")]
        lift: Option<f64>,
        #[allow(missing_docs, reason = "see above")]
        tangential: Option<f64>,
    },
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
    /// Moves a pinned particle along a path, at constant speed from point to point.
    PinPath {
        /// Number of the particle over all bodies, from 0.
        particle: u32,
        /// Times from the change on (s), above 0 and growing, each with the position (m) at which it is then. One step
        /// to the first at least.
        points: Arc<[(f64, [f64; 3])]>,
    },
}

impl Change {
    /// What it counts for in bounds on changes: 1, or 1 for each point of a path.
    pub fn weight(&self) -> usize {
        match self {
            Self::PinPath { points, .. } => points.len(),
            _ => 1,
        }
    }
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
    #[error("{field} is {}: allowed are {} to {}", number(*value), number(allowed[0]), number(allowed[1]))]
    OutOfRange { field: &'static str, value: f64, allowed: [f64; 2] },
    #[error("no body is named '{name}'; there are: {known}")]
    UnknownBody { name: String, known: String },
    #[error("body '{body}' has no {kind} springs")]
    NoSuchSprings { body: String, kind: &'static str },
    #[error("'{name}' is snow, which has no springs")]
    SnowHasNoSprings { name: String },
    #[error("body '{body}' feels no air: give it [body.air] in its scene")]
    NoAir { body: String },
    #[error("there is no air to change: no body has [body.air] in its scene")]
    NoneFeelsAir,
    #[error("there are no springs to change: there is no cloth")]
    NoCloth,
    #[error("particle {particle} is not pinned")]
    NotPinned { particle: u32 },
    #[error("there is no particle {particle}: there are {count}, from 0")]
    NoSuchParticle { particle: u32, count: usize },
    #[error("the path of particle {particle} has no points: one or more are needed")]
    EmptyPath { particle: u32 },
    #[error(
        "point {point} of the path of particle {particle} is at {} s: a time after {} s is needed",
        number(*time),
        number(*after)
    )]
    TimesOfPath { particle: u32, point: usize, time: f64, after: f64 },
}

/// Which changes a world accepts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChangeRules {
    particle_count: usize,
    /// Pinned particles over all bodies, in order.
    pinned: Vec<u32>,
    cloths: Vec<ClothRules>,
    /// Names of the objects of snow.
    snows: Vec<String>,
}

/// What changes of springs a cloth accepts.
#[derive(Clone, Debug, PartialEq, Eq)]
struct ClothRules {
    name: String,
    /// Kinds of its springs.
    kinds: Vec<SpringKind>,
    feels_air: bool,
}

impl ClothRules {
    fn has_springs(&self, kind: Option<SpringKind>) -> bool {
        kind.map_or(!self.kinds.is_empty(), |kind| self.kinds.contains(&kind))
    }
}

impl ChangeRules {
    /// The rules of a world of these bodies.
    pub(super) fn of<R: Real>(bodies: &[Body<R>]) -> Self {
        let mut rules = Self { particle_count: 0, pinned: Vec::new(), cloths: Vec::new(), snows: Vec::new() };
        for body in bodies {
            let first = body.first_particle();
            let own = 0..body.particle_count() as u32;
            rules.pinned.extend(own.filter(|own| body.is_pinned(*own)).map(|own| first + own));
            rules.particle_count += body.particle_count();
            match body {
                Body::Cloth(cloth) => {
                    let kinds = SpringKind::ALL.into_iter().filter(|kind| cloth.has_springs(Some(*kind)));
                    let (name, feels_air) = (cloth.name.clone(), cloth.feels_air());
                    rules.cloths.push(ClothRules { name, kinds: kinds.collect(), feels_air });
                }
                Body::Snow(snow) => {
                    rules.snows.extend(snow.snow.objects().map(|(object, _)| object.to_owned()));
                }
            }
        }
        rules
    }

    /// Checks changes without applying them.
    ///
    /// # Errors
    /// The first change that would be refused.
    pub fn check(&self, changes: &[Change]) -> Result<(), ChangeError> {
        changes.iter().try_for_each(|change| self.check_one(change))
    }

    fn check_one(&self, change: &Change) -> Result<(), ChangeError> {
        match change {
            Change::Gravity(value) => within("gravity", value, allowed::GRAVITY),
            Change::Wind(value) => within("wind", value, allowed::SPEED),
            Change::Drag(value) => within("drag", &[*value], allowed::DRAG),
            Change::Air { body, density, normal, lift, tangential } => {
                within("density", density.as_slice(), Air::DENSITY)?;
                for (name, number) in [("normal", normal), ("lift", lift), ("tangential", tangential)] {
                    within(name, number.as_slice(), Air::COEFFICIENT)?;
                }
                self.check_air(body.as_deref())
            }
            Change::Springs { body, kind, stiffness, damping } => {
                within("stiffness", stiffness.as_slice(), allowed::STIFFNESS)?;
                within("damping", damping.as_slice(), allowed::DAMPING)?;
                self.check_springs(body.as_deref(), *kind)
            }
            Change::Pin { particle, target, duration } => {
                within("target", target, allowed::LENGTH)?;
                within("duration", &[*duration], allowed::DURATION)?;
                self.check_pin(*particle)
            }
            Change::PinPath { particle, points } => {
                check_path(*particle, points)?;
                self.check_pin(*particle)
            }
        }
    }

    fn check_pin(&self, particle: u32) -> Result<(), ChangeError> {
        let count = self.particle_count;
        if particle as usize >= count {
            return Err(ChangeError::NoSuchParticle { particle, count });
        }

        let is_pinned = self.pinned.binary_search(&particle).is_ok();
        if is_pinned { Ok(()) } else { Err(ChangeError::NotPinned { particle }) }
    }

    fn check_air(&self, name: Option<&str>) -> Result<(), ChangeError> {
        let Some(name) = name else {
            let any = self.cloths.iter().any(|cloth| cloth.feels_air);
            return if any { Ok(()) } else { Err(ChangeError::NoneFeelsAir) };
        };
        match self.cloths.iter().find(|cloth| cloth.name == name) {
            Some(cloth) if cloth.feels_air => Ok(()),
            Some(_) => Err(ChangeError::NoAir { body: name.into() }),
            None if self.snows.iter().any(|object| object == name) => {
                Err(ChangeError::NoAir { body: name.into() })
            }
            None => Err(self.unknown_body(name)),
        }
    }

    fn unknown_body(&self, name: &str) -> ChangeError {
        let known = self.cloths.iter().map(|cloth| cloth.name.as_str()).collect::<Vec<_>>().join(", ");
        ChangeError::UnknownBody { name: name.into(), known }
    }

    fn check_springs(&self, name: Option<&str>, kind: Option<SpringKind>) -> Result<(), ChangeError> {
        if let Some(name) = name.filter(|name| self.snows.iter().any(|object| object == name)) {
            return Err(ChangeError::SnowHasNoSprings { name: name.into() });
        }
        if self.cloths.is_empty() {
            return Err(ChangeError::NoCloth);
        }

        let named = |cloth: &&ClothRules| name.is_none_or(|name| cloth.name == name);
        let mut found = self.cloths.iter().filter(named).peekable();
        if found.peek().is_none() {
            return Err(self.unknown_body(name.unwrap_or_default()));
        }

        if found.any(|cloth| cloth.has_springs(kind)) {
            return Ok(());
        }

        let kind = kind.map_or("any", SpringKind::name);
        Err(ChangeError::NoSuchSprings { body: name.unwrap_or("any").into(), kind })
    }
}

/// Times that grow, positions within their range.
fn check_path(particle: u32, points: &[(f64, [f64; 3])]) -> Result<(), ChangeError> {
    if points.is_empty() {
        return Err(ChangeError::EmptyPath { particle });
    }
    let mut after = 0.0;
    for (point, (time, target)) in points.iter().enumerate() {
        within("times", &[*time], allowed::DURATION)?;
        within("targets", target, allowed::LENGTH)?;
        if *time <= after {
            return Err(ChangeError::TimesOfPath { particle, point, time: *time, after });
        }
        after = *time;
    }
    Ok(())
}

fn within(field: &'static str, values: &[f64], allowed: [f64; 2]) -> Result<(), ChangeError> {
    let [low, high] = allowed;
    let wrong = values.iter().find(|value| !(low..=high).contains(*value));
    wrong.map_or(Ok(()), |&value| Err(ChangeError::OutOfRange { field, value, allowed }))
}
