//! A saved frame at which a run begins instead of at the start of its scene.
//!
//! Enters: a PLY file, or a folder of them, of which the last frame counts. Leaves: what a server is told of it, and whether the session
//! that it made is one of the frame.

use std::path::{Path, PathBuf};

use nappe_client::{Client, MeshUpload, Precision, v1};
use nappe_scene::{
    files::{self, ReadOptions},
    mesh::Loaded,
};

use crate::{
    files::frame_notes::FrameNotes,
    scenes::scene::Begun,
    words::{
        error::{CliError, Result},
        output,
    },
};

/// A saved frame: what it says of itself, and places and velocities of all particles.
#[derive(Debug)]
pub(super) struct SavedFrame {
    pub(super) file: PathBuf,
    pub(super) notes: FrameNotes,
    positions: Vec<[f64; 3]>,
    velocities: Vec<[f64; 3]>,
}

impl SavedFrame {
    /// Reads a file, or the last frame of a folder.
    ///
    /// # Errors
    /// When there is none, or it cannot be read.
    pub(super) fn read(path: &Path) -> Result<Self> {
        if !path.is_dir() {
            return Self::of_file(path.to_owned());
        }
        let last = frames(path)?.pop();
        let (_, file) = last.ok_or_else(|| {
            CliError::failure(format!("the folder {} holds no frame (frame-000000.ply)", path.display()))
        })?;
        Self::of_file(file)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// When it cannot be read, has no velocities, or is of a later version.
    pub(super) fn of_file(file: PathBuf) -> Result<Self> {
        let name = file.display().to_string();
        let notes = FrameNotes::of_file(&file).map_err(|error| CliError::file("read", &file, &error))?;
        if let Some(version) = notes.newer_version() {
            let own = env!("CARGO_PKG_VERSION");
            return Err(CliError::failure(format!("{name} was saved by nappe {version}, and this is {own}"))
                .hint("a version that is as late reads it"));
        }
        let loaded = files::load_mesh(&file, &ReadOptions::default());
        let Loaded { mesh, .. } = loaded.map_err(|error| CliError::failure(error.to_string()))?;
        if mesh.velocities.is_empty() {
            return Err(CliError::failure(format!("{name} has no velocities (vx, vy, vz)"))
                .hint("frames saved with --fields velocity have them"));
        }
        Ok(Self { file, notes, positions: mesh.points, velocities: mesh.velocities })
    }

    /// Sends the frame to a server. `scene` is what the scene is known by that is to begin there, if that is at hand: what
    /// the frame says of steps in another one does not count.
    ///
    /// # Errors
    /// When the server takes no upload.
    pub(super) async fn send(&self, client: &Client, scene: Option<&str>) -> Result<Begun> {
        let (name, notes) = (self.file.display(), &self.notes);
        let is_other = match (notes.scene.as_deref(), scene) {
            (Some(saved), Some(own)) => saved != own,
            _ => false,
        };
        if is_other {
            output::note(&format!(
                "warning: the scene is another one than when {name} was saved: the run goes on by the scene as it is now"
            ));
        }
        if notes.step.is_none() {
            output::note(&format!("warning: {name} says no step: the clock of the scene begins at 0"));
        }

        let upload = MeshUpload {
            name: name.to_string(),
            points: self.positions.clone(),
            velocities: self.velocities.clone(),
            ..MeshUpload::default()
        };
        let upload_id = client.upload_mesh(&upload).await?.mesh_id;
        let begin = v1::Begin {
            step: notes.step.unwrap_or(0),
            time_seconds: notes.step.and(notes.time),
            upload_id,
            carried: notes.carried.clone().filter(|_| !is_other),
        };
        Ok(Begun { file: self.file.clone(), begin })
    }

    /// Checks that a session which was made begins at the frame, in its precision.
    ///
    /// # Errors
    /// When its server does not know how, or its precision is another one.
    pub(super) fn check(&self, session: &v1::Session) -> Result<()> {
        let Some(step) = self.notes.step else { return Ok(()) };
        let name = self.file.display();
        if session.step != step {
            return Err(CliError::failure(format!(
                "the server does not begin at step {step}, that of {name}: its version is an earlier one"
            )));
        }
        let saved = match self.notes.precision {
            Some(Precision::F32) => v1::Precision::F32,
            Some(Precision::F64) => v1::Precision::F64,
            None => return Ok(()),
        };
        if session.precision() == saved {
            return Ok(());
        }
        let (saved, own) = (saved.word(), session.precision().word());
        Err(CliError::failure(format!("{name} is in {saved}, and the run is to be in {own}"))
            .hint(format!("--precision {saved} goes on in that of the frame")))
    }
}

/// The frames in a folder by their numbers, the last one last.
///
/// # Errors
/// When the folder cannot be read.
pub(super) fn frames(folder: &Path) -> Result<Vec<(u64, PathBuf)>> {
    let entries =
        std::fs::read_dir(folder).map_err(|error| CliError::file("read the folder", folder, &error))?;
    let number = |path: &Path| -> Option<u64> {
        path.file_name()?.to_str()?.strip_prefix("frame-")?.strip_suffix(".ply")?.parse().ok()
    };
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let mut frames: Vec<(u64, PathBuf)> =
        paths.filter_map(|path| number(&path).map(|number| (number, path))).collect();
    frames.sort();
    Ok(frames)
}
