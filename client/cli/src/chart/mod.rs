//! A chart on its way out: its files, and what is said of it.
//!
//! Enters: a chart of a study. Leaves: chart.csv, chart.json and pictures in a folder; words on standard output.

pub(crate) mod units;
pub(crate) mod words;
mod subject;
mod table;
mod document;

use std::{
    fs,
    path::{Path, PathBuf},
};

use nappe_study::Chart;

pub(crate) use self::subject::Subject;

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
    let probe = folder.join(".nappe-chart");
    fs::write(&probe, [])
        .and_then(|()| fs::remove_file(&probe))
        .map_err(|error| CliError::file("write into", folder, &error))
}

/// Writes the files of a chart into a folder; their paths.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write(folder: &Path, subject: &Subject, chart: &Chart) -> Result<Vec<PathBuf>> {
    let document = serde_json::to_string_pretty(&document::document(subject, chart))
        .map_err(|error| CliError::failure(format!("cannot write the chart as JSON: {error}")))?;
    let files = [
        ("chart.csv".to_owned(), table::text(&subject.name, subject.threads, chart).into_bytes()),
        ("chart.json".to_owned(), (document + "\n").into_bytes()),
    ];
    let mut written = Vec::new();
    for (name, bytes) in files.into_iter().chain(pictures(&subject.name, chart)?) {
        let path = folder.join(name);
        fs::write(&path, bytes).map_err(|error| CliError::file("write", &path, &error))?;
        written.push(path);
    }
    Ok(written)
}

/// Pictures, each as SVG and PNG.
#[cfg(feature = "charts")]
fn pictures(scene: &str, chart: &Chart) -> Result<Vec<(String, Vec<u8>)>> {
    let pictures = nappe_charts::pictures(scene, chart)
        .map_err(|error| CliError::failure(format!("cannot draw the chart: {error}")))?;
    let files = |picture: nappe_charts::Picture| {
        [
            (format!("{}.svg", picture.name), picture.svg.into_bytes()),
            (format!("{}.png", picture.name), picture.png),
        ]
    };
    Ok(pictures.into_iter().flat_map(files).collect())
}

/// None: this build draws nothing, and says so.
#[cfg(not(feature = "charts"))]
fn pictures(_: &str, _: &Chart) -> Result<Vec<(String, Vec<u8>)>> {
    crate::output::note("no pictures: this command was built without its feature `charts`");
    Ok(Vec::new())
}

/// What the system calls the processor.
pub(crate) fn processor() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned())
}
