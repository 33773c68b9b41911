//! A study of stability on its way out: its files, and what is said of it.
//!
//! Enters: a study. Leaves: stability.csv, stability.json and pictures in a folder; words on standard output.

pub(crate) mod words;
mod table;
mod document;
pub(crate) mod gallery;

use std::path::PathBuf;

use nappe_study::Stability;

use crate::{
    error::{CliError, Result},
    study::{LookArgs, Subject, files},
};

/// Names of the files of a study.
pub(crate) const FILES: [&str; 4] = ["stability", "limits", "map_damping", "map_compression"];

/// Writes the files of a study into a folder; their paths.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write(
    folder: &files::Folder,
    subject: &Subject,
    study: &Stability,
    look: &LookArgs,
) -> Result<Vec<PathBuf>> {
    let document = serde_json::to_string_pretty(&document::document(subject, study))
        .map_err(|error| CliError::failure(format!("cannot write the study as JSON: {error}")))?;
    let files = [
        ("stability.csv".to_owned(), table::text(&subject.name, &study.rows).into_bytes()),
        ("stability.json".to_owned(), (document + "\n").into_bytes()),
    ];
    folder.write(files.into_iter().chain(pictures(&subject.name, study, look)?))
}

/// Pictures, each as SVG and PNG.
#[cfg(feature = "charts")]
fn pictures(scene: &str, study: &Stability, look: &LookArgs) -> Result<Vec<(String, Vec<u8>)>> {
    nappe_charts::stability_pictures(scene, study, &look.style())
        .map(files::of_pictures)
        .map_err(|error| CliError::failure(format!("cannot draw the study: {error}")))
}

/// None: this build draws nothing, and says so.
#[cfg(not(feature = "charts"))]
fn pictures(_: &str, _: &Stability, _: &LookArgs) -> Result<Vec<(String, Vec<u8>)>> {
    files::note_without_pictures();
    Ok(Vec::new())
}
