//! The simulation file: steps, gravity, viscosity, the kind of each object.

use std::collections::BTreeMap;

use super::parameter_file::{Entry, ParameterFile};
use crate::error::{ErrorKind, SceneError, excerpt};

/// What an object of the course is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ObjectKind {
    /// `mss`: particles joined by springs.
    MassSpring,
    /// `particule`: particles without springs.
    Particles,
    /// `sph`: a fluid; not done here.
    Fluid,
    /// `rigid`: a solid; not done here.
    Rigid,
}

impl ObjectKind {
    /// Every kind that the course has, done here or not.
    pub const ALL: [Self; 4] = [Self::MassSpring, Self::Particles, Self::Fluid, Self::Rigid];

    /// Its name in simulation files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::MassSpring => "mss",
            Self::Particles => "particule",
            Self::Fluid => "sph",
            Self::Rigid => "rigid",
        }
    }

    fn of(entry: &Entry<'_>) -> Result<Self, SceneError> {
        let name = entry.value().to_lowercase();
        Self::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| {
            let message = format!("is '{}'; allowed: mss, particule", excerpt(entry.value()));
            entry.error(ErrorKind::OutOfRange, message)
        })
    }
}

/// A simulation file.
#[derive(Clone, Debug, PartialEq)]
pub struct SimuParameters {
    /// Its name in messages.
    pub file: String,
    /// `NbIter`: steps to run; 0 when the file does not say.
    pub steps: u64,
    /// `Gx`, `Gy`, `Gz`: gravity (m/s²); 0 when the file does not say.
    pub gravity: [f64; 3],
    /// `viscosite`: viscosity of the medium.
    pub viscosity: Option<f64>,
    /// `objet1`, `objet2` ...: kind and line of each object, by its number from 1.
    pub kinds: BTreeMap<usize, (ObjectKind, usize)>,
    /// What is odd about the file.
    pub warnings: Vec<String>,
}

impl SimuParameters {
    /// Reads a simulation file.
    ///
    /// # Errors
    /// A line that is not `Key=value;`, a value that is not what its key needs.
    pub fn parse(text: &str, file: &str) -> Result<Self, SceneError> {
        let mut keys = ParameterFile::read(text, file)?;
        let steps = keys.whole("NbIter")?;
        let mut gravity = [0.0; 3];
        for (component, key) in gravity.iter_mut().zip(["Gx", "Gy", "Gz"]) {
            match keys.number(key)? {
                Some(value) => *component = value,
                None => keys.warnings.push(format!("{file}: {key} is missing: 0 is taken")),
            }
        }

        let viscosity = keys.number("viscosite")?;
        let kinds = keys
            .take_numbered("objet")
            .into_iter()
            .map(|(number, entry)| Ok((number, (ObjectKind::of(&entry)?, entry.line_number()))))
            .collect::<Result<_, SceneError>>()?;
        if steps.is_none() {
            keys.warnings.push(format!("{file}: NbIter is missing: the simulation does not end by itself"));
        }
        let warnings = keys.finish(&[], &["NbIter", "Gx", "Gy", "Gz", "viscosite", "objet1"]);
        Ok(Self { file: file.to_owned(), steps: steps.unwrap_or(0), gravity, viscosity, kinds, warnings })
    }
}
