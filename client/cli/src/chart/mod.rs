//! A chart on its way out: its files, and what is said of it; the profile of several.
//!
//! Enters: charts of a study. Leaves: chart.csv, chart.json and pictures in a folder, profile.csv, profile.json and a picture of
//! several; words on standard output.

pub(crate) mod words;
pub(crate) mod table;
mod document;
mod profile;
pub(crate) mod several;

use std::path::PathBuf;

use nappe_study::Chart;

use crate::{
    error::{CliError, Result},
    study::{LookArgs, Subject, files},
};

/// Names of the files of a chart.
pub(crate) const FILES: [&str; 4] = ["chart", "work_precision", "convergence", "window"];

/// Writes the files of a chart into a folder; their paths.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write(
    folder: &files::Folder,
    subject: &Subject,
    chart: &Chart,
    look: &LookArgs,
) -> Result<Vec<PathBuf>> {
    let document = serde_json::to_string_pretty(&document::document(subject, chart))
        .map_err(|error| CliError::failure(format!("cannot write the chart as JSON: {error}")))?;
    let files = [
        ("chart.csv".to_owned(), table::text(&subject.name, subject.threads, chart).into_bytes()),
        ("chart.json".to_owned(), (document + "\n").into_bytes()),
    ];
    folder.write(files.into_iter().chain(pictures(&subject.name, chart, look)?))
}

/// Pictures, each as SVG and PNG.
#[cfg(feature = "charts")]
fn pictures(scene: &str, chart: &Chart, look: &LookArgs) -> Result<Vec<(String, Vec<u8>)>> {
    nappe_charts::pictures(scene, chart, &look.style())
        .map(files::of_pictures)
        .map_err(|error| CliError::failure(format!("cannot draw the chart: {error}")))
}

/// None: this build draws nothing, and says so.
#[cfg(not(feature = "charts"))]
fn pictures(_: &str, _: &Chart, _: &LookArgs) -> Result<Vec<(String, Vec<u8>)>> {
    files::note_without_pictures();
    Ok(Vec::new())
}
