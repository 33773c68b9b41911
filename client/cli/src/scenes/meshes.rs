//! Mesh files of the command line: reading with the choice about missing masses, warnings, hints; sending to a server.
//!
//! Enters: a path. Leaves: a mesh, and the id that a server gives to it; warnings on standard error.

use std::path::Path;

use clap::Args;
use nappe_client::{Client, MeshFile, MeshUpload, v1};
use nappe_scene::{
    ErrorKind, SceneError, SceneErrors,
    files::{self, ReadOptions},
    mesh::{EtiOptions, Loaded, write_ply},
};
use nappe_server::numbers::{KILOGRAMS, Least, real};
use nappe_sim::mesh::TriangleMesh;

use crate::{
    files::write,
    words::{
        error::{CliError, Result},
        output,
    },
};

/// What to do about points without a mass.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(crate) struct MissingMass {
    /// Mass (kg) of the points that a masses.eti leaves out, 0 for pinned ones; without it, that is an error
    #[arg(long = "missing-mass", value_name = "KG", value_parser = real(KILOGRAMS, Least::From0))]
    value: Option<f64>,
}

impl MissingMass {
    /// The choice, as the readers of meshes take it.
    pub(crate) fn options(self) -> ReadOptions {
        ReadOptions { eti: EtiOptions { missing_mass: self.value }, ..ReadOptions::default() }
    }
}

/// Reads a mesh file; what is odd about it goes to standard error.
///
/// # Errors
/// When it cannot be read.
pub(crate) fn load(path: &Path, missing: MissingMass) -> Result<Loaded> {
    let loaded = files::load_mesh(path, &missing.options()).map_err(in_words)?;
    note(&loaded.warnings);
    Ok(loaded)
}

/// Reads a file of frames as it is sent, once it is seen to be one.
///
/// # Errors
/// When it cannot be read, or is none.
pub(crate) fn read_frames(path: &Path) -> Result<MeshFile> {
    files::load_frames(path, &ReadOptions::default())?;
    MeshFile::read(path).map_err(|error| CliError::failure(format!("{}: {error}", path.display())))
}

/// Sends a mesh to a server, and returns the id by which scenes name it: as arrays, or as a PLY where it has springs, which
/// arrays do not hold.
///
/// # Errors
/// When the server refuses it.
pub(crate) async fn send(client: &Client, name: &str, mesh: &TriangleMesh) -> Result<String> {
    if mesh.springs.is_empty() {
        return Ok(client.upload_mesh(&arrays(name, mesh)).await?.mesh_id);
    }
    let mut bytes = Vec::new();
    write_ply(mesh, &mut bytes).map_err(|error| CliError::failure(format!("{name}: {error}")))?;
    let file = MeshFile {
        name: name.to_owned(),
        format: v1::FileFormat::Ply,
        file: bytes.into(),
        others: Default::default(),
        missing_mass: None,
    };
    Ok(client.upload_file(&file).await?.mesh_id)
}

fn arrays(name: &str, mesh: &TriangleMesh) -> MeshUpload {
    MeshUpload {
        name: name.to_owned(),
        points: mesh.points.clone(),
        triangles: mesh.triangles.clone(),
        masses: mesh.masses.clone(),
        uv: mesh.uv.iter().map(|&[u, v]| [u as f32, v as f32]).collect(),
        velocities: mesh.velocities.clone(),
    }
}

/// Prints warnings on standard error, one that repeats once.
pub(crate) fn note(warnings: &[String]) {
    for line in merged(warnings) {
        output::note(&format!("warning: {line}"));
    }
}

/// Warnings in the order in which each comes first, with how often it comes.
fn merged(warnings: &[String]) -> Vec<String> {
    let mut counted: Vec<(&str, usize)> = Vec::new();
    for warning in warnings {
        match counted.iter_mut().find(|(before, _)| before == warning) {
            Some((_, count)) => *count += 1,
            None => counted.push((warning.as_str(), 1)),
        }
    }
    let line = |(warning, count): (&str, usize)| match count {
        1 => warning.to_owned(),
        _ => format!("{warning} ({count} times)"),
    };
    counted.into_iter().map(line).collect()
}

/// Names the option that helps, where one does.
pub(crate) fn in_words(error: SceneError) -> CliError {
    if lacks_masses(&error) {
        return CliError::from(error).hint("--missing-mass KG gives the missing ones a mass");
    }
    error.into()
}

/// Whether it is only masses that a mesh lacks.
pub(crate) fn lacks_masses(error: &SceneError) -> bool {
    error.kind == ErrorKind::Inconsistent && error.message.contains("missing mass")
}

impl From<SceneError> for CliError {
    fn from(error: SceneError) -> Self {
        match error.kind {
            ErrorKind::Exists => write::stays(Path::new(&error.file)),
            _ => Self::failure(error),
        }
    }
}

impl From<SceneErrors> for CliError {
    fn from(errors: SceneErrors) -> Self {
        Self::failure(errors)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_that_repeats_is_one_line_with_its_count() {
        let warnings = ["a", "b", "a", "a", "c"].map(str::to_owned);
        assert_eq!(merged(&warnings), ["a (3 times)", "b", "c"]);
        assert!(merged(&[]).is_empty());
    }
}
