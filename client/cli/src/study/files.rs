//! Files of a study: the folder that they are written into, tables and pictures.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::error::{CliError, Result};

/// Makes a folder, where there is none, and checks that files can be written into it.
///
/// # Errors
/// A path that is a file, or that cannot be written.
pub(crate) fn check_folder(folder: &Path) -> Result<()> {
    if folder.is_file() {
        return Err(CliError::usage(format!("--out {}: is a file; a folder is needed", folder.display())));
    }
    fs::create_dir_all(folder).map_err(|error| CliError::file("make the folder", folder, &error))?;
    let probe = folder.join(".nappe-study");
    fs::write(&probe, [])
        .and_then(|()| fs::remove_file(&probe))
        .map_err(|error| CliError::file("write into", folder, &error))
}

/// Writes files into a folder; their paths.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write(folder: &Path, files: impl Iterator<Item = (String, Vec<u8>)>) -> Result<Vec<PathBuf>> {
    let mut written = Vec::new();
    for (name, bytes) in files {
        let path = folder.join(name);
        fs::write(&path, bytes).map_err(|error| CliError::file("write", &path, &error))?;
        written.push(path);
    }
    Ok(written)
}

/// Says where files are.
pub(crate) fn told(written: &[PathBuf]) -> String {
    let paths: Vec<_> = written.iter().map(|path| path.display().to_string()).collect();
    format!("Written: {}", paths.join(", "))
}

/// Each picture as SVG and PNG.
#[cfg(feature = "charts")]
pub(crate) fn of_pictures(pictures: Vec<nappe_charts::Picture>) -> Vec<(String, Vec<u8>)> {
    let files = |picture: nappe_charts::Picture| {
        [
            (format!("{}.svg", picture.name), picture.svg.into_bytes()),
            (format!("{}.png", picture.name), picture.png),
        ]
    };
    pictures.into_iter().flat_map(files).collect()
}

/// Says that this build draws nothing.
#[cfg(not(feature = "charts"))]
pub(crate) fn note_without_pictures() {
    crate::output::note("no pictures: this command was built without its feature `charts`");
}

/// A field of comma-separated values, in quotes where it needs them (RFC 4180).
pub(crate) fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_end_a_field_is_quoted() {
        assert_eq!(quoted("plain"), "plain");
        assert_eq!(quoted("a, \"b\""), "\"a, \"\"b\"\"\"");
    }
}
