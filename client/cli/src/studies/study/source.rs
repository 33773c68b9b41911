//! A scene that is studied, as the command line names it.

use std::{
    path::Path,
    time::{Duration, Instant},
};

use nappe_scene::{Built, MeshSource, Scene, SceneLimits, files};
use nappe_study::{Case, Measure};
use xxhash_rust::xxh3::xxh3_64;

use super::subject::{Subject, processor, threads};
use crate::{
    files::paths,
    scenes::{meshes, scene},
    words::{
        error::{CliError, Result},
        output,
    },
};

/// A scene that is studied.
pub(crate) struct Source {
    /// Its name, without folder and extension.
    pub(crate) name: String,
    /// Hash of its text, 16 hexadecimal digits.
    pub(crate) hash: String,
    /// Whether all of it is studied, and no snow beside cloth is left out.
    pub(crate) is_whole: bool,
    /// As it is written.
    pub(crate) scene: Scene,
    /// The cloths that are built from it, or the snow.
    pub(crate) case: Case,
}

impl Source {
    /// Where the meshes of a scene are that the command line names so: beside its file.
    pub(crate) fn meshes(name: &str) -> files::Folder {
        let path = Path::new(name);
        let folder = if paths::is_scene(path) { path.parent() } else { None };
        let folder = folder.unwrap_or(Path::new("")).to_owned();
        files::Folder { folder, options: files::ReadOptions::default() }
    }

    /// The text of a shipped scene or of a file.
    ///
    /// # Errors
    /// A scene that is not shipped, and a file that cannot be read.
    pub(crate) fn text(name: &str) -> Result<String> {
        let path = Path::new(name);
        if paths::is_scene(path) { scene::file_text(path) } else { Ok(scene::shipped_text(name)?.to_owned()) }
    }

    /// Reads a shipped scene or a file, and tells what it warns of, and that snow is left out by a verb.
    ///
    /// # Errors
    /// A scene that cannot be read or built, or has neither cloth nor snow.
    pub(crate) fn read(name: &str, verb: &str) -> Result<Self> {
        let text = Self::text(name)?;
        let scene = Scene::parse(&text, name)?;
        let Built { setup, initial_changes, warnings, .. } =
            scene.build(&Self::meshes(name), &SceneLimits::default())?;
        meshes::note(&warnings);
        let has_snow = setup.snow.is_some();
        let name = Path::new(name).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let case = Case::new(&name, setup, initial_changes, scene.precision).map_err(CliError::failure)?;
        let is_whole = !has_snow || case.is_snow();
        if !is_whole {
            meshes::note(&[format!("snow is left out: {verb} studies its cloths")]);
        }
        Ok(Self { name, hash: output::hash(xxh3_64(text.as_bytes())), is_whole, scene, case })
    }

    /// Its copy that is coarser by a whole number, 2 or more.
    ///
    /// # Errors
    /// Why there is none that can be studied, and what works.
    pub(crate) fn coarser(&self, by: u32, meshes: &dyn MeshSource) -> std::result::Result<Self, String> {
        if !self.is_whole {
            let what = "a scene of cloth and snow has no coarser copy that is compared; a scene of cloth or of snow alone has";
            return Err(what.to_owned());
        }
        let scene = self.scene.coarser(by).map_err(|errors| errors.to_string())?;
        let built = scene.build(meshes, &SceneLimits::default()).map_err(|errors| errors.to_string())?;
        let name = format!("{} coarser by {by}", self.name);
        let case = Case::new(&name, built.setup, built.initial_changes, scene.precision);
        let measure = self.case.measure();
        if matches!(measure, Measure::Coordinate { .. }) {
            let what = format!(
                "{} is compared, and a copy has other particles; motion, end, energy and sag work",
                measure.words()
            );
            return Err(what);
        }
        let case = case.map_err(|error| error.to_string())?.measuring(measure.clone());
        let case = case.map_err(|error| error.to_string())?;
        Ok(Self { name, hash: self.hash.clone(), is_whole: true, scene, case })
    }

    /// What is studied, on so many threads if they are told, within a budget that began then.
    pub(crate) fn subject(&self, asked: Option<u16>, budget: Duration, begin: Instant) -> Subject {
        Subject {
            name: self.name.clone(),
            instead: None,
            scene_hash: self.hash.clone(),
            is_whole: self.is_whole,
            processor: processor(),
            threads: threads(asked),
            budget,
            begin,
        }
    }
}
