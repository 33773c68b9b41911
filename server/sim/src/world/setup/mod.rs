//! What a world is built from, in binary64 and the user's numbering; and why one cannot be built.

pub(crate) mod wind;
pub(crate) mod forces;
pub(crate) mod pulls;
pub(crate) mod vectors;
pub(crate) mod report;
pub(crate) mod topology;
pub(crate) mod parameters;

use serde::{Deserialize, Serialize};

use thiserror::Error;

use forces::TimedForce;
use wind::Wind;

use crate::{
    cloth::{ClothSettings, Minimizer, Network, SurfaceCheck},
    collide::{Bounds, Collider, FASTEST},
    linalg::{OperatorKind, PreconditionerKind},
    math::{four_digits, number},
    snow::{SnowError, SnowSetup},
};

/// A cloth of a world, or a figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodySetup {
    /// Name, unique in the world.
    pub name: String,
    /// Particles and springs.
    pub network: Network,
    /// How it is stepped.
    pub settings: ClothSettings,
    /// Forces on its particles.
    pub forces: Vec<TimedForce>,
}

/// Everything that a simulation starts from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WorldSetup {
    /// Time step of the world (s), above 0.
    pub dt: f64,
    /// Gravity of all bodies (m/s²).
    pub gravity: [f64; 3],
    /// Velocity of the medium (m/s).
    pub wind: [f64; 3],
    /// In its place times (s), growing, each with the velocity then (m/s): straight between them; empty for one velocity.
    pub wind_at: Vec<(f64, [f64; 3])>,
    /// What particles hit, in the order in which they are met.
    pub colliders: Vec<Collider>,
    /// Cloths and figures: their particles come first, in this order. Those with a thickness meet each other.
    pub bodies: Vec<BodySetup>,
    /// Snow; a world has a cloth or snow at least. Cloth and snow do not touch each other yet.
    pub snow: Option<SnowSetup>,
}

/// A world that cannot be built.
#[derive(Clone, Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum SetupError {
    #[error("the world has no bodies")]
    NoBodies,
    #[error("dt is {0}: a time step is a finite number of seconds above 0")]
    BadTimeStep(f64),
    #[error("{what} is not finite: {value:?}")]
    NotFinite { what: String, value: [f64; 3] },
    #[error("{0}")]
    Wind(String),
    #[error("body '{body}': {message}")]
    Body { body: String, message: String },
    #[error(transparent)]
    Snow(#[from] SnowError),
    #[error("collider '{collider}': {message}")]
    Collider { collider: String, message: String },
}

impl WorldSetup {
    /// Checks that several ranks can step it together.
    ///
    /// # Errors
    /// The body that they cannot step, and why.
    pub fn check_for_ranks(&self) -> Result<(), SetupError> {
        let refused = |body: &str, what: &str| {
            let message = format!("{what} cannot be stepped over several ranks");
            Err(SetupError::Body { body: body.to_owned(), message })
        };
        for BodySetup { name, network, settings, .. } in &self.bodies {
            if network.thickness > 0.0 {
                return refused(name, "cloth with a thickness");
            }
            if settings.contact.surface == SurfaceCheck::Count {
                return refused(name, "surface = \"count\"");
            }
            if settings.rest.is_some() {
                return refused(name, "cloth that is watched for rest");
            }
        }
        let solved = self.snow.iter().filter(|snow| snow.settings.integration.is_implicit());
        if let Some(object) = solved.flat_map(|snow| &snow.objects).next() {
            return refused(&object.name, "semi-implicit snow (its integration, beta)");
        }
        for BodySetup { name, settings, .. } in
            self.bodies.iter().filter(|body| body.settings.integrator.is_implicit())
        {
            if matches!(settings.minimizer, Minimizer::VertexBlockDescent { .. }) {
                return refused(name, "minimizer = \"vertex_block_descent\"");
            }
            if settings.solver.operator == OperatorKind::Assembled {
                return refused(name, "operator = \"assembled\"");
            }
            if settings.solver.preconditioner == PreconditionerKind::Patches {
                return refused(name, "preconditioner = \"patches\"");
            }
        }
        Ok(())
    }

    /// The least and the greatest coordinates (m) of all particles; none without particles.
    pub fn bounds(&self) -> Option<Bounds> {
        let cloth = self.bodies.iter().flat_map(|body| &body.network.x);
        let snow = self.snow.iter().flat_map(|snow| &snow.objects).flat_map(|object| &object.x);
        cloth.chain(snow).map(|x| [*x, *x]).reduce(|[low, high], [x, _]| {
            [[0, 1, 2].map(|c| f64::min(low[c], x[c])), [0, 1, 2].map(|c| f64::max(high[c], x[c]))]
        })
    }

    /// Checks what does not belong to one body alone.
    pub(crate) fn check(&self) -> Result<(), SetupError> {
        if self.bodies.is_empty() && self.snow.is_none() {
            return Err(SetupError::NoBodies);
        }
        if !self.dt.is_finite() || self.dt <= 0.0 {
            return Err(SetupError::BadTimeStep(self.dt));
        }

        for (what, value) in [("gravity", self.gravity), ("wind", self.wind)] {
            if value.iter().any(|c| !c.is_finite()) {
                return Err(SetupError::NotFinite { what: what.into(), value });
            }
        }

        if let Some(message) = Wind::invalid(&self.wind_at) {
            return Err(SetupError::Wind(message));
        }

        let objects = self.snow.iter().flat_map(|snow| &snow.objects).map(|object| &object.name);
        let names: Vec<&String> = self.bodies.iter().map(|body| &body.name).chain(objects).collect();
        if let Some(twice) = (1..names.len()).find(|i| names[..*i].contains(&names[*i])) {
            let message = "two bodies have this name: names are unique".into();
            return Err(SetupError::Body { body: names[twice].clone(), message });
        }

        let particles = self.bounds();
        self.colliders.iter().try_for_each(|collider| {
            let fast = || collider.too_fast(particles?).map(too_fast);
            match collider.invalid().or_else(fast) {
                Some(message) => Err(SetupError::Collider { collider: collider.name.clone(), message }),
                None => Ok(()),
            }
        })
    }
}

/// That a surface is too fast on its way to a key, and how fast it is (m/s).
fn too_fast((key, speed): (usize, f64)) -> String {
    format!(
        "from key {} to key {key} its surface has up to {} m/s where particles can meet it: at most {} m/s are allowed",
        key - 1,
        four_digits(speed),
        number(FASTEST)
    )
}
