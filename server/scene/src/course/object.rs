//! An object file: mesh files, springs, time step, integration.

use nappe_sim::math::number;

use super::parameter_file::ParameterFile;
use crate::error::{ErrorKind, SceneError, excerpt};

/// How an object is advanced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ObjectIntegration {
    /// `explicite`: symplectic Euler, which the course calls semi-implicit.
    SymplecticEuler,
    /// `implicite`: Baraff and Witkin's implicit Euler, with `NbIterVitImpl` iterations.
    ImplicitEuler {
        /// Iterations of the linear solver; none when the file does not say.
        iterations: Option<u32>,
    },
}

/// An object file.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectParameters {
    /// Its name in messages.
    pub file: String,
    /// `Points`: the file of the points.
    pub points: String,
    /// `FaceSet`: the file of the triangles.
    pub faceset: Option<String>,
    /// `Masses`: the file of the masses.
    pub masses: String,
    /// `Textures`: the file of the texture coordinates, where `UseTexture` is not 0.
    pub textures: Option<String>,
    /// `k`: stiffness of every spring (N/m).
    pub stiffness: Option<f64>,
    /// `nu`: damping of every spring (N s/m).
    pub damping: Option<f64>,
    /// `dt`: time step (s).
    pub dt: f64,
    /// The file's `Integration`.
    pub integration: ObjectIntegration,
    /// `Interaction`: whether the user may move pinned particles.
    pub interaction: bool,
    /// What is odd about the file.
    pub warnings: Vec<String>,
}

/// ParameterFile of fluids and solids.
const UNUSED: [&str; 16] = [
    "rho0",
    "bulk",
    "h",
    "positionX",
    "positionY",
    "positionZ",
    "rotationX",
    "rotationY",
    "rotationZ",
    "rotationAngle",
    "quantiteMouvX",
    "quantiteMouvY",
    "quantiteMouvZ",
    "momentCinetiqueX",
    "momentCinetiqueY",
    "momentCinetiqueZ",
];

const KNOWN: [&str; 11] = [
    "Points",
    "FaceSet",
    "Masses",
    "Textures",
    "k",
    "nu",
    "dt",
    "Integration",
    "NbIterVitImpl",
    "Interaction",
    "UseTexture",
];

impl ObjectParameters {
    /// Reads an object file.
    ///
    /// # Errors
    /// A line that is not `Key=value;`, a value that is not what its key needs, no `Points`, no
    /// `Masses`, no `dt`.
    pub fn parse(text: &str, file: &str) -> Result<Self, SceneError> {
        let mut keys = ParameterFile::read(text, file)?;
        let points = keys.path("Points").ok_or_else(|| keys.missing("Points", "the file of the points"))?;
        let masses = keys.path("Masses").ok_or_else(|| keys.missing("Masses", "the file of the masses"))?;
        let faceset = keys.path("FaceSet");
        let textures = keys.path("Textures");
        let (stiffness, damping) = (keys.number("k")?, keys.number("nu")?);
        let dt = match keys.take("dt") {
            Some(entry) => {
                let dt = entry.number()?;
                if dt <= 0.0 {
                    let message = format!("is {}; allowed: a number of seconds above 0", number(dt));
                    return Err(entry.error(ErrorKind::OutOfRange, message));
                }
                dt
            }
            None => return Err(keys.missing("dt", "the time step (s)")),
        };

        let integration = integration(&mut keys)?;
        let interaction = yes_or_no(&mut keys, "Interaction", "no")?;
        let use_texture = yes_or_no(&mut keys, "UseTexture", "1")?;
        let warnings = keys.finish(&UNUSED, &KNOWN);
        Ok(Self {
            file: file.to_owned(),
            points,
            faceset,
            masses,
            textures: textures.filter(|_| use_texture),
            stiffness,
            damping,
            dt,
            integration,
            interaction,
            warnings,
        })
    }
}

fn integration(keys: &mut ParameterFile<'_>) -> Result<ObjectIntegration, SceneError> {
    let iterations = match keys.take("NbIterVitImpl") {
        Some(entry) => {
            let count = u32::try_from(entry.whole()?).ok().filter(|count| (1..=1_000_000).contains(count));
            let allowed = "allowed: a whole number, 1 to 1000000";
            let out_of_range =
                || entry.error(ErrorKind::OutOfRange, format!("is {}; {allowed}", excerpt(entry.value())));
            Some(count.ok_or_else(out_of_range)?)
        }
        None => None,
    };

    let Some(entry) = keys.take("Integration") else {
        return Err(keys.missing("Integration", "explicite or implicite"));
    };
    match entry.value().to_lowercase().as_str() {
        "explicite" => Ok(ObjectIntegration::SymplecticEuler),
        "implicite" => Ok(ObjectIntegration::ImplicitEuler { iterations }),
        other => {
            let message = format!("is '{}'; allowed: explicite, implicite", excerpt(other));
            Err(entry.error(ErrorKind::OutOfRange, message))
        }
    }
}

fn yes_or_no(keys: &mut ParameterFile<'_>, key: &str, default: &str) -> Result<bool, SceneError> {
    let entry = keys.take(key);
    let value = entry.as_ref().map_or(default, |entry| entry.value()).to_lowercase();
    match (value.as_str(), entry) {
        ("yes" | "oui" | "1", _) => Ok(true),
        ("no" | "non" | "0", _) | (_, None) => Ok(false),
        (other, Some(entry)) => {
            let message = format!("is '{}'; allowed: yes, no, 1, 0", excerpt(other));
            Err(entry.error(ErrorKind::OutOfRange, message))
        }
    }
}
