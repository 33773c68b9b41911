//! The profile of several charts on its way out: profile.csv, profile.json, its picture, words.

use std::path::PathBuf;

use nappe_study::{
    Chart, Effort,
    profile::{Cost, Line, Profile, Run, runs},
};
use serde_json::{Value, json};

use super::document::compared;
use crate::{
    studies::study::{
        Contents, Folder, HASH_OF, LookArgs, Subject,
        csv::{self, known},
    },
    words::{
        error::Result,
        output::{Column, length, table},
    },
};

/// Names of the files of a profile.
pub(crate) const FILES: [&str; 1] = ["profile"];
/// Names of the columns: they stay.
const COLUMNS: [&str; 7] = [
    "scene",
    "method",
    "precision",
    "seconds_per_simulated_second",
    "seconds_ratio",
    "counts",
    "counts_ratio",
];
/// Methods that are told of on standard output, at most.
const TOLD: usize = 8;

/// What is kept of the chart of a scene.
pub(crate) struct Charted {
    subject: Subject,
    runs: Vec<Run>,
    rows: usize,
    /// The last comparison time (s).
    until: f64,
    /// What was compared, and for how long.
    compared: Value,
    effort: Option<Effort>,
    is_cut: bool,
    is_stopped: bool,
}

impl Charted {
    /// That of a chart.
    pub(crate) fn new(subject: Subject, chart: &Chart) -> Self {
        let (rows, until, effort) = (chart.rows.len(), chart.until(), chart.effort);
        let (is_cut, is_stopped) = (chart.is_cut, chart.is_stopped);
        let compared = compared(chart);
        Self { subject, runs: runs(chart), rows, until, compared, effort, is_cut, is_stopped }
    }

    /// What scripts are told of it.
    fn said(&self) -> Value {
        json!({
            "scene": self.subject.name,
            "scene_hash": self.subject.scene_hash,
            "rows": self.rows,
            "until_s": self.until,
            "compared": self.compared,
            "effort": self.effort.map(Effort::class),
            "cut": self.is_cut,
        })
    }
}

/// The profile of charts to a tolerance (m).
pub(crate) fn profile(charts: &[Charted], tolerance: f64) -> Profile {
    let scenes = charts.iter().map(|chart| (chart.subject.name.clone(), chart.runs.as_slice()));
    let cut = charts.iter().filter(|chart| chart.is_cut).map(|chart| chart.subject.name.clone()).collect();
    Profile { cut, ..Profile::new(tolerance, &scenes.collect::<Vec<_>>()) }
}

/// Writes the files of a profile into a folder; their paths.
///
/// # Errors
/// What cannot be drawn, and a file that cannot be written.
pub(crate) fn write(
    folder: &Folder,
    charts: &[Charted],
    profile: &Profile,
    look: &LookArgs,
) -> Result<Vec<PathBuf>> {
    let contents = Contents {
        name: "profile",
        table: rows(profile),
        document: Some(document(charts, profile)),
        #[cfg(feature = "charts")]
        draw: &|style| Ok(vec![nappe_charts::profile_picture(profile, style)?]),
    };
    folder.write(look, contents)
}

/// A row per scene and method.
fn rows(profile: &Profile) -> String {
    let row = |(place, line): (usize, &Line)| {
        let Cost { seconds, seconds_ratio, count, count_ratio } = line.costs[place];
        [
            profile.scenes[place].clone(),
            line.method.clone(),
            line.precision.to_string(),
            known(seconds),
            known(seconds_ratio),
            known(count),
            known(count_ratio),
        ]
    };
    let of_scene = |place: usize| profile.lines.iter().map(move |line| (place, line));
    csv::text(COLUMNS, (0..profile.scenes.len()).flat_map(of_scene).map(row))
}

/// The document. Its names stay.
fn document(charts: &[Charted], profile: &Profile) -> Value {
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
        "tolerance_m": profile.tolerance,
        "budget_s": charts.first().map(|chart| chart.subject.budget.as_secs_f64()),
        "largest_ratio": largest,
        "unsolved": profile.unsolved(),
        "cut": profile.cut,
        "methods": profile.lines.iter().map(line).collect::<Vec<_>>(),
        "summary": summary(profile),
    })
}

/// What scripts are told.
pub(crate) fn said(charts: &[Charted], profile: &Profile, written: &[PathBuf]) -> Value {
    json!({
        "scenes": charts.iter().map(Charted::said).collect::<Vec<_>>(),
        "hash_of": HASH_OF,
        "tolerance_m": profile.tolerance,
        "interrupted": charts.iter().any(|one| one.is_stopped),
        "files": written,
    })
}

/// The best methods as a table, and a summary.
pub(crate) fn text(profile: &Profile) -> String {
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
    let summary = summary(profile);
    if rows.is_empty() { summary } else { format!("{}\n\n{summary}", table(&columns, &rows)) }
}

/// How many scenes there are, and on which of them nothing is accurate enough.
fn summary(profile: &Profile) -> String {
    let (count, tolerance) = (profile.scenes.len(), length(profile.tolerance));
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
