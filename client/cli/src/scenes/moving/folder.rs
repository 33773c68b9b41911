//! A folder with a mesh for each frame, in the order of their names.

use std::{
    fs,
    path::{Path, PathBuf},
};

use nappe_scene::files::{self, ReadOptions};

use super::frame::{Ending, Frame, check_size};
use crate::words::error::{CliError, Result};

/// What the files of a folder hold.
#[derive(Debug)]
pub(super) struct Folder {
    pub(super) frames: Vec<Frame>,
    /// Those of the first file, which all have.
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Reads all .obj and .ply files of a folder.
///
/// # Errors
/// A folder without such files, one of them that cannot be read, or that has other points or triangles than the first.
pub(super) fn read(folder: &Path, ending: Ending) -> Result<Folder> {
    let mut paths = meshes(folder)?;
    if ending == Ending::Looped && paths.len() > 1 {
        paths.pop();
    }
    let Some(first) = paths.first() else {
        let message =
            format!("{}: has no meshes; allowed: .obj or .ply files, one for each frame", folder.display());
        return Err(CliError::failure(message));
    };

    let mut read = Folder { frames: Vec::new(), triangles: Vec::new() };
    for path in &paths {
        let mesh = files::load_mesh(path, &ReadOptions::default())?.mesh;
        match read.frames.first() {
            None => {
                check_size(folder, mesh.points.len(), paths.len())?;
                read.triangles = mesh.triangles;
            }
            Some(points) if points.len() != mesh.points.len() || read.triangles != mesh.triangles => {
                return Err(CliError::failure(format!(
                    "{}: has {} points, and other triangles or another number of points than {}, which has {}; allowed: the \
                     same points and triangles in each file",
                    path.display(),
                    mesh.points.len(),
                    first.display(),
                    points.len()
                )));
            }
            Some(_) => {}
        }
        read.frames.push(mesh.points.iter().map(|point| point.map(|c| c as f32)).collect());
    }
    Ok(read)
}

/// The meshes of a folder, by name.
fn meshes(folder: &Path) -> Result<Vec<PathBuf>> {
    let refused = |error: std::io::Error| CliError::file("read", folder, &error);
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(refused)? {
        let path = entry.map_err(refused)?.path();
        let is_mesh = |extension: &std::ffi::OsStr| {
            ["obj", "ply"].iter().any(|known| extension.eq_ignore_ascii_case(known))
        };
        if path.is_file() && path.extension().is_some_and(is_mesh) {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}
