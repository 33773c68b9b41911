//! A chart on its way out: its files, and what is said of it; the profile of several.
//!
//! Enters: charts of a study. Leaves: chart.csv, chart.json and pictures in a folder, profile.csv, profile.json and a picture of
//! several; words on standard output.

pub(crate) mod words;
pub(crate) mod table;
pub(crate) mod document;
pub(crate) mod several;

use std::path::PathBuf;

use nappe_study::Chart;

use crate::{
    studies::study::{Contents, Folder, LookArgs, Subject},
    words::error::Result,
};

/// Names of the files of a chart.
pub(crate) const FILES: [&str; 4] = ["chart", "work_precision", "convergence", "window"];

/// Writes the files of a chart into a folder; their paths.
///
/// # Errors
/// What cannot be drawn, and a file that cannot be written.
pub(crate) fn write(
    folder: &Folder,
    subject: &Subject,
    chart: &Chart,
    look: &LookArgs,
) -> Result<Vec<PathBuf>> {
    let contents = Contents {
        name: "chart",
        table: table::text(&subject.name, subject.threads, chart),
        document: Some(document::document(subject, chart)),
        #[cfg(feature = "charts")]
        draw: &|style| nappe_charts::pictures(&subject.name, chart, &subject.styled(style)),
    };
    folder.write(look, contents)
}
