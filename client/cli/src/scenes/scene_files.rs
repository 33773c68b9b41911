//! A scene that this program made as files of its own: the scene file, and beside it a PLY file for the mesh of each body.
//!
//! Enters: a scene, with its meshes by the paths that it names. Leaves: files that `nappe run` reads.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use nappe_scene::{Mesh, Scene, mesh::write_ply};
use nappe_sim::mesh::TriangleMesh;

use crate::{
    files::write::{self, Existing},
    words::error::{CliError, Result},
};

/// Writes them, the scene below a comment, and gives their paths. Nothing is written if one of them stays.
///
/// # Errors
/// A scene that its schema does not allow, a file that is there and stays, one that cannot be written.
pub(crate) fn write(
    path: &Path,
    comment: &str,
    mut scene: Scene,
    meshes: &BTreeMap<String, TriangleMesh>,
    existing: Existing,
) -> Result<Vec<PathBuf>> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut files = Vec::new();
    for body in &mut scene.bodies {
        let Mesh::File { file, .. } = &mut body.mesh else { continue };
        let Some(mesh) = meshes.get(file.as_str()) else { continue };
        let name = format!("{stem}-{}.ply", body.name);
        let (place, mut bytes) = (path.with_file_name(&name), Vec::new());
        write_ply(mesh, &mut bytes).map_err(|error| CliError::file("write", &place, &error))?;
        files.push((place, bytes));
        *file = name;
    }
    let text = format!("# {comment}\n{}", scene.to_toml());
    // What no scene file may say is refused before there is one.
    Scene::parse(&text, &path.display().to_string())?;
    files.push((path.to_owned(), text.into_bytes()));

    files.iter().try_for_each(|(file, _)| write::check(file, existing))?;
    files.iter().try_for_each(|(file, bytes)| write::write_whole(file, bytes, existing))?;
    Ok(files.into_iter().map(|(file, _)| file).collect())
}
