//! What snow is built from, in binary64 and the user's numbering.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{
    law::Material,
    settings::{Blend, Integration, Kernel, SnowSettings, Transfer},
};
use crate::time_step::TimeStep;

/// An object of snow: particles of one material. Objects share the grid and so collide.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SnowObject {
    /// Name, unique among all bodies of the world.
    pub name: String,
    /// Positions (m).
    pub x: Vec<[f64; 3]>,
    /// Velocities (m/s), as many.
    pub v: Vec<[f64; 3]>,
    /// Angular velocity (rad/s) that `v` holds: the velocity around each particle varies as it says from the
    /// first step on. 0: the velocity around a particle is its own.
    pub angular_velocity: [f64; 3],
    /// Masses (kg), as many, above 0.
    pub mass: Vec<f64>,
    /// Volumes at rest (m³), as many, above 0; empty: from the density on the grid before the
    /// first step (Stomakhin et al. 2013, step 2).
    pub volume: Vec<f64>,
    /// Factors on Young's modulus, as many, above 0; empty: 1.
    pub stiffness: Vec<f64>,
    /// What all of its particles are made of.
    pub material: Material,
    /// Name of a sticky collider that stands: particles within half a cell of its surface are held to it. None: none are.
    pub attach: Option<String>,
}

impl SnowObject {
    /// C (1/s) of its particles at the start, by rows: C d = w x d.
    pub(crate) fn affine_velocity(&self) -> [[f64; 3]; 3] {
        // 0 less a number: what does not turn has zeros without a sign.
        let [x, y, z] = self.angular_velocity;
        [[0.0, 0.0 - z, y], [z, 0.0, 0.0 - x], [0.0 - y, x, 0.0]]
    }
}

/// Snow: objects on one grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SnowSetup {
    /// Objects, at least one.
    pub objects: Vec<SnowObject>,
    /// How they are stepped.
    pub settings: SnowSettings,
}

/// Snow that cannot be built.
#[derive(Clone, Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum SnowError {
    #[error("snow: {0}")]
    Settings(String),
    #[error("snow '{object}': {message}")]
    Object { object: String, message: String },
}

/// Checks whether a setup can be simulated; the strings are warnings.
pub(super) fn check(setup: &SnowSetup) -> Result<Vec<String>, SnowError> {
    settings_error(&setup.settings).map_or(Ok(()), |error| Err(SnowError::Settings(error)))?;

    if setup.objects.is_empty() || setup.objects.len() > usize::from(u16::MAX) {
        return Err(SnowError::Settings(format!("{} objects: 1 to 65535 are needed", setup.objects.len())));
    }

    let count: usize = setup.objects.iter().map(|object| object.x.len()).sum();
    if count == 0 || count > u32::MAX as usize / 2 {
        return Err(SnowError::Settings(format!("{count} particles: 1 to {} are needed", u32::MAX / 2)));
    }

    for object in &setup.objects {
        if let Some(message) = object_error(object) {
            return Err(SnowError::Object { object: object.name.clone(), message });
        }
    }

    let mut warnings = Vec::new();
    if setup.settings.kernel == Kernel::Linear {
        warnings
            .push("snow: the linear kernel is here to show how it fails: forces jump at cell borders".into());
    }

    Ok(warnings)
}

fn settings_error(settings: &SnowSettings) -> Option<String> {
    let above = |what: &str, value: f64, least: f64, most: f64| {
        let fits = value.is_finite() && value > least && value <= most;
        (!fits).then(|| format!("{what} is {value}: above {least} and at most {most} is needed"))
    };
    let within = |what: &str, value: f64, least: f64, most: f64| {
        (!(least..=most).contains(&value)).then(|| format!("{what} is {value}: {least} to {most} is needed"))
    };
    above("cell", settings.cell, 0.0, 1e6)
        .or_else(|| match settings.transfer {
            Transfer::PicFlip(Blend::PerStep(share)) => within("the share of FLIP", share, 0.0, 1.0),
            Transfer::PicFlip(Blend::TimeConstant(tau)) => above("the time constant of FLIP", tau, 0.0, 1e9),
            Transfer::Apic | Transfer::Mls => None,
        })
        .or_else(|| match settings.time_step {
            TimeStep::Certified { safety } => above("safety", safety, 0.0, 1.0),
            TimeStep::Fixed(dt) | TimeStep::Unchecked(dt) => above("the fixed step", dt, 0.0, 1.0),
        })
        .or_else(|| match settings.integration {
            Integration::SemiImplicit { beta, .. } => beta_error(beta),
            Integration::Explicit => None,
        })
        .or_else(|| within("ballistic_below", settings.ballistic_below, 0.0, 1.0))
        .or_else(|| within("drag", settings.drag, 0.0, SnowSettings::MOST_DRAG))
        .or_else(|| {
            (settings.max_substeps == 0).then(|| "max_substeps is 0: at least 1 is needed".to_owned())
        })
        .or_else(|| settings.invalid_combination())
}

fn beta_error(beta: f64) -> Option<String> {
    let least = Integration::LEAST_BETA;
    let fits = beta == 0.0 || (least..=1.0).contains(&beta);
    (!fits).then(|| {
        format!(
            "beta is {beta}: 0 or {least} to 1 is needed; below {least} elastic waves bound the step as they bound an explicit one"
        )
    })
}

fn object_error(object: &SnowObject) -> Option<String> {
    let count = object.x.len();
    for (what, found, may_be_empty) in [
        ("velocities", object.v.len(), false),
        ("masses", object.mass.len(), false),
        ("volumes", object.volume.len(), true),
        ("stiffness factors", object.stiffness.len(), true),
    ] {
        if found != count && !(may_be_empty && found == 0) {
            return Some(format!("{count} positions and {found} {what}: as many are needed"));
        }
    }

    let vectors = [("position", &object.x), ("velocity", &object.v)];
    for (what, values) in vectors {
        if let Some(i) = values.iter().position(|v| v.iter().any(|c| !c.is_finite())) {
            return Some(format!("the {what} of particle {i} is {:?}: finite numbers are needed", values[i]));
        }
    }

    if object.angular_velocity.iter().any(|c| !c.is_finite()) {
        return Some(format!(
            "its angular velocity is {:?}: finite numbers are needed",
            object.angular_velocity
        ));
    }

    let numbers =
        [("mass", &object.mass), ("volume", &object.volume), ("stiffness factor", &object.stiffness)];
    for (what, values) in numbers {
        if let Some(i) = values.iter().position(|n| !n.is_finite() || *n <= 0.0) {
            return Some(format!(
                "the {what} of particle {i} is {}: a finite number above 0 is needed",
                values[i]
            ));
        }
    }

    if let (Some(collider), Some(_)) = (&object.attach, object.material.plasticity) {
        return Some(format!(
            "it is attached to '{collider}' and may yield: only an elastic object is attached"
        ));
    }

    object.material.error()
}
