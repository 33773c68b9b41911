//! The gallery on its way out: gallery.csv and its picture, words on standard output.

use std::{fmt::Write as _, path::PathBuf};

use nappe_study::{
    Verdict,
    gallery::{Exhibit, Family, Finding, Table},
};
use serde_json::{Value, json};

use crate::{
    studies::study::{Contents, Folder, LookArgs, csv},
    words::{
        error::Result,
        output::{Column, table},
    },
};

/// The least width in print (mm): below it, words would be smaller than 6 pt beside a column per method.
pub(crate) const LEAST_WIDTH: f64 = 160.0;

/// Names of the files of the gallery.
pub(crate) const FILES: [&str; 1] = ["gallery"];

/// Writes the files of the gallery into a folder; their paths.
///
/// # Errors
/// What cannot be drawn, and a file that cannot be written.
pub(crate) fn write(folder: &Folder, tables: &[Table], look: &LookArgs) -> Result<Vec<PathBuf>> {
    let contents = Contents {
        name: "gallery",
        table: rows(tables),
        document: None::<Value>,
        #[cfg(feature = "charts")]
        draw: &|style| Ok(vec![nappe_charts::gallery_picture(tables, style)?]),
    };
    folder.write(look, contents)
}

/// Findings with their scenes and methods, but for methods that a scene does not concern.
fn cells(tables: &[Table]) -> impl Iterator<Item = (&Exhibit, &str, &Finding)> {
    tables
        .iter()
        .flat_map(|table| {
            table.scenes.iter().flat_map(|exhibit| {
                let cells = table.methods.iter().zip(&exhibit.findings);
                cells.map(move |(method, finding)| (exhibit, method.as_str(), finding))
            })
        })
        .filter(|(_, _, finding)| finding.verdict != Verdict::None)
}

/// A row per scene and method. Names of columns stay.
fn rows(tables: &[Table]) -> String {
    let row = |(exhibit, method, finding): (&Exhibit, &str, &Finding)| {
        let number = exhibit.number.to_string();
        [number.as_str(), exhibit.what, method, finding.verdict.name(), finding.detail.as_str()]
            .map(str::to_owned)
    };
    csv::text(["number", "scene", "method", "verdict", "detail"], cells(tables).map(row))
}

/// How many cells have a verdict.
fn count(tables: &[Table], verdict: Verdict) -> usize {
    cells(tables).filter(|(_, _, finding)| finding.verdict == verdict).count()
}

/// What scripts are told.
pub(crate) fn document(tables: &[Table], written: &[PathBuf]) -> Value {
    json!({
        "rows": cells(tables).count(),
        "survived": count(tables, Verdict::Survived),
        "recovered": count(tables, Verdict::Recovered),
        "detected": count(tables, Verdict::Detected),
        "wrong": count(tables, Verdict::Wrong),
        "warned": count(tables, Verdict::Warned),
        "lost": count(tables, Verdict::Lost),
        "files": written,
    })
}

/// The letters of a scene's verdicts by methods of a family.
fn letters(tables: &[Table], exhibit: &Exhibit, families: &[Family]) -> String {
    let of_family = tables.iter().filter(|table| families.contains(&table.family));
    let same = |other: &&Exhibit| (other.number, other.what) == (exhibit.number, exhibit.what);
    let findings = of_family.flat_map(|table| &table.scenes).find(same).map(|found| &found.findings);
    let letters: Vec<String> =
        findings.into_iter().flatten().map(|finding| finding.letter().to_string()).collect();
    letters.join(" ")
}

/// Letters of all verdicts, and what they mean.
pub(crate) fn text(tables: &[Table]) -> String {
    let scenes =
        tables.iter().filter(|table| table.family != Family::Implicit).flat_map(|table| &table.scenes);
    let row = |exhibit: &Exhibit| {
        vec![
            format!("{:>2}. {}", exhibit.number, exhibit.what),
            letters(tables, exhibit, &[Family::Explicit]),
            letters(tables, exhibit, &[Family::Implicit, Family::Squeezed]),
            letters(tables, exhibit, &[Family::Snow]),
        ]
    };
    let columns =
        [Column::Left("scene"), Column::Left("explicit"), Column::Left("implicit"), Column::Left("snow")];
    let mut text = table(&columns, &scenes.map(row).collect::<Vec<_>>());
    for table in tables.iter().filter(|table| table.family != Family::Squeezed) {
        let name = match table.family {
            Family::Explicit => "explicit",
            Family::Implicit | Family::Squeezed => "implicit",
            Family::Snow => "snow",
        };
        let _ = write!(text, "\n{name}: {}", table.methods.join(", "));
    }
    let [survived, recovered, detected, wrong, warned, lost] = [
        Verdict::Survived,
        Verdict::Recovered,
        Verdict::Detected,
        Verdict::Wrong,
        Verdict::Warned,
        Verdict::Lost,
    ]
    .map(|verdict| count(tables, verdict));
    let _ = write!(
        text,
        "\n\n{survived} survived (S), {recovered} recovered in shorter steps (R), {detected} ended with a reason (D), {wrong} ended \
         without one and are wrong (X), {warned} were warned of (W); {lost} lost their way without a word (L). A dot is no \
         concern of the method."
    );
    text
}
