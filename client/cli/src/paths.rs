//! What a path on the command line means: an HTML file, a recording, a folder, a scene file.
//!
//! Enters: a path, as it was typed. Leaves: whether it is one, or what is wrong with it.

use std::path::Path;

use nappe_scene::suggestion;

use crate::error::{CliError, Result};

/// Whether a path names a Rerun recording.
pub(crate) fn is_recording(path: &Path) -> bool {
    has_extension(path, "rrd")
}

/// Whether a path names an HTML file.
pub(crate) fn is_html(path: &Path) -> bool {
    has_extension(path, "html")
}

/// Whether a path names a scene file.
pub(crate) fn is_scene(path: &Path) -> bool {
    has_extension(path, "toml")
}

fn has_extension(path: &Path, wanted: &str) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(wanted))
}

/// Checks that `--save` names an HTML file, a recording or a folder.
///
/// # Errors
/// When the path has another extension, and is not a folder that exists.
pub(crate) fn check_save(path: &Path) -> Result<()> {
    if is_recording(path) || is_html(path) || path.extension().is_none() || path.is_dir() {
        return Ok(());
    }
    let ending = format!(".{}", path.extension().unwrap_or_default().to_string_lossy());
    let near = suggestion(&ending, [".html", ".rrd"]);
    Err(CliError::usage(format!("--save {}: no frames are kept in a {ending}; {near}", path.display())).hint(
        "an HTML page ends in .html, a Rerun recording in .rrd; the name of a new folder of PLY meshes has no extension",
    ))
}
