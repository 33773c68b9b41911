//! The profile of several charts on its way out: profile.csv, profile.json, its picture, words.

use std::{fmt::Write as _, path::PathBuf};

use nappe_study::Chart;
use serde_json::{Value, json};

use super::{
    profile::{Cost, Line, Profile, Run, runs},
    words::length,
};
use crate::{
    error::{CliError, Result},
    output::{Column, table},
    study::{
        HASH_OF, LookArgs, Subject,
        files::{self, quoted},
    },
};

/// Names of the files of a profile.
pub(crate) const FILES: [&str; 1] = ["profile"];
/// Methods that are told of on standard output, at most.
const TOLD: usize = 8;

/// What is kept of the chart of a scene.
pub(crate) struct Charted {
    subject: Subject,
    runs: Vec<Run>,
    rows: usize,
    /// The last comparison time (s).
    until: f64,
    is_cut: bool,
    is_stopped: bool,
}

impl Charted {
    /// That of a chart.
    pub(crate) fn new(subject: Subject, chart: &Chart) -> Self {
        let (rows, until) = (chart.rows.len(), chart.until());
        let (is_cut, is_stopped) = (chart.is_cut, chart.is_stopped);
        Self { subject, runs: runs(chart), rows, until, is_cut, is_stopped }
    }

    /// What scripts are told of it.
    fn said(&self) -> Value {
        json!({
            "scene": self.subject.name,
            "scene_hash": self.subject.scene_hash,
            "rows": self.rows,
            "until_s": self.until,
            "cut": self.is_cut,
        })
    }
}

/// The profile of charts.
pub(crate) fn profile(charts: &[Charted]) -> Profile {
    let scenes = charts.iter().map(|chart| (chart.subject.name.clone(), chart.runs.as_slice()));
    let cut = charts.iter().filter(|chart| chart.is_cut).map(|chart| chart.subject.name.clone()).collect();
    Profile { cut, ..Profile::new(&scenes.collect::<Vec<_>>()) }
}

/// Writes the files of a profile to a tolerance (m) into a folder; their paths.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write(
    folder: &files::Folder,
    charts: &[Charted],
    (profile, tolerance): (&Profile, f64),
    look: &LookArgs,
) -> Result<Vec<PathBuf>> {
    let document = serde_json::to_string_pretty(&document(charts, profile, tolerance))
        .map_err(|error| CliError::failure(format!("cannot write the profile as JSON: {error}")))?;
    let files = [
        ("profile.csv".to_owned(), csv(profile).into_bytes()),
        ("profile.json".to_owned(), (document + "\n").into_bytes()),
    ];
    folder.write(files.into_iter().chain(pictures(profile, tolerance, look)?))
}

/// The picture, as SVG and PNG.
#[cfg(feature = "charts")]
fn pictures(profile: &Profile, tolerance: f64, look: &LookArgs) -> Result<Vec<(String, Vec<u8>)>> {
    let line = |line: &Line| {
        let mut ratios: Vec<f64> = line.ratios().collect();
        ratios.sort_by(f64::total_cmp);
        nappe_charts::ProfileLine { name: line.name.clone(), precision: line.precision, ratios }
    };
    let drawn = nappe_charts::Profile {
        tolerance,
        scenes: profile.scenes.len(),
        unsolved: profile.unsolved(),
        cut: profile.cut.clone(),
        lines: profile.lines.iter().map(line).collect(),
    };
    nappe_charts::profile_picture(&drawn, &look.style())
        .map(|picture| files::of_pictures(vec![picture]))
        .map_err(|error| CliError::failure(format!("cannot draw the profile: {error}")))
}

/// None: this build draws nothing, and says so.
#[cfg(not(feature = "charts"))]
fn pictures(_: &Profile, _: f64, _: &LookArgs) -> Result<Vec<(String, Vec<u8>)>> {
    files::note_without_pictures();
    Ok(Vec::new())
}

/// A row per scene and method. Names of columns stay.
fn csv(profile: &Profile) -> String {
    let mut text =
        "scene,method,precision,seconds_per_simulated_second,seconds_ratio,counts,counts_ratio\n".to_owned();
    let known = |value: Option<f64>| value.map(|value| format!("{value:?}")).unwrap_or_default();
    for (place, scene) in profile.scenes.iter().enumerate() {
        for line in &profile.lines {
            let Cost { seconds, seconds_ratio, count, count_ratio } = line.costs[place];
            let fields = [
                quoted(scene),
                line.method.clone(),
                line.precision.to_string(),
                known(seconds),
                known(seconds_ratio),
                count.map(|count| count.to_string()).unwrap_or_default(),
                known(count_ratio),
            ];
            // Writing into a string does not fail.
            let _ = writeln!(text, "{}", fields.join(","));
        }
    }
    text
}

/// The document. Its names stay.
fn document(charts: &[Charted], profile: &Profile, tolerance: f64) -> Value {
    let largest = profile.largest_ratio();
    let line = |line: &Line| {
        json!({
            "method": line.method,
            "name": line.name,
            "precision": line.precision.to_string(),
            "solved": line.ratios().count(),
            "cheapest": line.within(1.0),
            "within_twice": line.within(2.0),
            "area": line.area(largest),
        })
    };
    let machine = charts
        .first()
        .map(|chart| json!({ "processor": chart.subject.processor, "threads": chart.subject.threads }));
    json!({
        "scenes": charts.iter().map(Charted::said).collect::<Vec<_>>(),
        "hash_of": HASH_OF,
        "version": env!("CARGO_PKG_VERSION"),
        "machine": machine,
        "tolerance_m": tolerance,
        "budget_s": charts.first().map(|chart| chart.subject.budget.as_secs_f64()),
        "largest_ratio": largest,
        "unsolved": profile.unsolved(),
        "cut": profile.cut,
        "methods": profile.lines.iter().map(line).collect::<Vec<_>>(),
        "summary": summary(profile, tolerance),
    })
}

/// What scripts are told.
pub(crate) fn said(charts: &[Charted], tolerance: f64, written: &[PathBuf]) -> Value {
    json!({
        "scenes": charts.iter().map(Charted::said).collect::<Vec<_>>(),
        "hash_of": HASH_OF,
        "tolerance_m": tolerance,
        "interrupted": charts.iter().any(|one| one.is_stopped),
        "files": written,
    })
}

/// The best methods as a table, and a summary.
pub(crate) fn text(profile: &Profile, tolerance: f64) -> String {
    let row = |line: &Line| {
        let counts = [line.ratios().count(), line.within(1.0), line.within(2.0)];
        let mut cells = vec![format!("{} {}", line.method, line.precision)];
        cells.extend(counts.map(|count| count.to_string()));
        cells
    };
    let held = profile.lines.iter().filter(|line| line.ratios().next().is_some());
    let rows: Vec<_> = held.take(TOLD).map(row).collect();
    let columns = [
        Column::Left("method"),
        Column::Right("scenes that it is right on"),
        Column::Right("cheapest"),
        Column::Right("within twice the cheapest"),
    ];
    let summary = summary(profile, tolerance);
    if rows.is_empty() { summary } else { format!("{}\n\n{summary}", table(&columns, &rows)) }
}

/// How many scenes there are, and on which of them nothing is right enough.
fn summary(profile: &Profile, tolerance: f64) -> String {
    let (count, tolerance) = (profile.scenes.len(), length(tolerance));
    let unsolved = profile.unsolved();
    let text = if unsolved.is_empty() {
        format!("On each of {count} scenes some method is within {tolerance}.")
    } else {
        format!(
            "Of {count} scenes no method is within {tolerance} on these, which count for none: {}.",
            unsolved.join(", ")
        )
    };
    if profile.cut.is_empty() {
        return text;
    }
    format!(
        "{text} Out of time: not every method was followed to its end on {}, where it counts as one that is not right; a larger --budget \
         goes further.",
        profile.cut.join(", ")
    )
}
