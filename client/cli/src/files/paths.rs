//! What a path on the command line means: a file with frames, a table, a recording, a picture, a folder, a scene file.
//!
//! Enters: a path, as it was typed. Leaves: whether it is one, or what is wrong with it.

use std::path::Path;

use nappe_scene::suggestion;

use crate::words::error::{CliError, Result};

/// Whether a path names a Rerun recording.
pub(crate) fn is_recording(path: &Path) -> bool {
    has_extension(path, "rrd")
}

/// Whether a path names an HTML file.
pub(crate) fn is_html(path: &Path) -> bool {
    has_extension(path, "html")
}

/// Whether a path names an index of files for ParaView.
pub(crate) fn is_vtk(path: &Path) -> bool {
    has_extension(path, "pvd")
}

/// Whether a path names a scene of USD, in its text form.
pub(crate) fn is_usd(path: &Path) -> bool {
    has_extension(path, "usda")
}

/// Whether a path names a table.
pub(crate) fn is_table(path: &Path) -> bool {
    has_extension(path, "csv")
}

/// Whether a path names a picture.
pub(crate) fn is_picture(path: &Path) -> bool {
    has_extension(path, "png")
}

/// Whether a path names a film.
pub(crate) fn is_film(path: &Path) -> bool {
    has_extension(path, "mp4")
}

/// Whether a path names what a browser draws of a page.
pub(crate) fn is_drawn(path: &Path) -> bool {
    is_picture(path) || is_film(path)
}

/// Whether a path names a scene file.
pub(crate) fn is_scene(path: &Path) -> bool {
    has_extension(path, "toml")
}

fn has_extension(path: &Path, wanted: &str) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(wanted))
}

/// Extensions of `--save`: a page, a recording, files of VTK, a scene of USD, a table, a picture, a film.
const EXTENSIONS: [&str; 7] = ["html", "rrd", "pvd", "usda", "csv", "png", "mp4"];

/// Whether `--save` with a path names a folder of PLY files, and no file.
pub(crate) fn is_folder(path: &Path) -> bool {
    !EXTENSIONS.iter().any(|extension| has_extension(path, extension))
}

/// Checks that `--save` names a file of a kind that there is, or a folder.
///
/// # Errors
/// When the path has another extension, and is not a folder that exists.
pub(crate) fn check_save(path: &Path) -> Result<()> {
    if EXTENSIONS.iter().any(|extension| has_extension(path, extension))
        || path.extension().is_none()
        || path.is_dir()
    {
        return Ok(());
    }
    let ending = format!(".{}", path.extension().unwrap_or_default().to_string_lossy());
    let endings = EXTENSIONS.map(|extension| format!(".{extension}"));
    let near = suggestion(&ending, endings.iter().map(String::as_str));
    Err(CliError::usage(format!("--save {}: no frames are kept in a {ending}; {near}", path.display())).hint(
        "an HTML page ends in .html, a Rerun recording in .rrd, an index of files for ParaView in .pvd, a scene of USD in .usda, a table in .csv, a picture in .png, a film in .mp4; the name of a new folder of PLY meshes has no extension",
    ))
}

/// Checks that `--table` names a table.
///
/// # Errors
/// When the path has another extension.
pub(crate) fn check_table(path: &Path) -> Result<()> {
    if is_table(path) {
        return Ok(());
    }
    Err(CliError::usage(format!("--table {}: a table is a file whose name ends in .csv", path.display())))
}
