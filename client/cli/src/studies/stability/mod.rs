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
    studies::study::{Contents, Folder, LookArgs, Subject},
    words::error::Result,
};

/// Names of the files of a study.
pub(crate) const FILES: [&str; 4] = ["stability", "limits", "map_damping", "map_compression"];

/// Writes the files of a study into a folder; their paths.
///
/// # Errors
/// What cannot be drawn, and a file that cannot be written.
pub(crate) fn write(
    folder: &Folder,
    subject: &Subject,
    study: &Stability,
    look: &LookArgs,
) -> Result<Vec<PathBuf>> {
    let contents = Contents {
        name: "stability",
        table: table::text(&subject.name, &study.rows),
        document: Some(document::document(subject, study)),
        #[cfg(feature = "charts")]
        draw: &|style| nappe_charts::stability_pictures(&subject.name, study, style),
    };
    folder.write(look, contents)
}
