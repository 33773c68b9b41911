//! The picture of a sweep: what was measured, against one key or over two.

use super::table::{Columns, Table};
#[cfg(feature = "charts")]
use super::{run::BEFORE, table::is_ok};
#[cfg(feature = "charts")]
use crate::words::output;
use crate::{studies::study::files, words::error::Result};

/// Runs that are drawn, at most.
#[cfg(feature = "charts")]
const MOST: usize = 10_000;

/// The picture of a table as files. Where it has none, a note says why.
///
/// # Errors
/// What cannot be drawn.
#[cfg(feature = "charts")]
pub(crate) fn picture_files(
    scene: &str,
    columns: &Columns<'_>,
    table: &Table,
) -> Result<Vec<(String, Vec<u8>)>> {
    if let Some(why) = why_none(columns, table) {
        output::note(&format!("no picture: {why}"));
        return Ok(Vec::new());
    }
    let first = 1 + columns.keys.len();
    let measures = columns.measures.iter().map(|measure| measure.name.as_str());
    let mut drawn: Vec<(usize, &str)> = (first + BEFORE.len()..).zip(measures).collect();
    if drawn.is_empty() {
        // A map shows the first alone.
        let own: &[&str] =
            if columns.keys.len() == 1 { &["energy_j", "max_stretch"] } else { &["max_stretch"] };
        drawn = (first..).zip(BEFORE).filter(|(_, name)| own.contains(name)).collect();
    }
    let number = |row: &[String], place: usize| {
        row.get(place).and_then(|field| field.parse::<f64>().ok()).unwrap_or(f64::NAN)
    };
    let of_row = |row: Vec<String>| nappe_charts::SweepRun {
        values: row.get(1..first).unwrap_or_default().to_vec(),
        measured: is_ok(&row).then(|| drawn.iter().map(|(place, _)| number(&row, *place)).collect()),
    };
    let sweep = nappe_charts::Sweep {
        scene: scene.to_owned(),
        keys: columns.keys.to_vec(),
        units: columns.keys.iter().map(|key| nappe_scene::unit(key).to_owned()).collect(),
        quantities: drawn.iter().map(|(_, name)| (*name).to_owned()).collect(),
        runs: table.rows().map(of_row).collect(),
        count: table.runs(),
    };
    files::of_pictures("sweep", nappe_charts::sweep_picture(&sweep).map(|picture| vec![picture]))
}

/// Why a sweep has no picture, if it has none.
#[cfg(feature = "charts")]
fn why_none(columns: &Columns<'_>, table: &Table) -> Option<String> {
    let keys = columns.keys.len();
    match (keys, table.runs()) {
        (3.., _) => Some(format!("it shows one key or two, and there are {keys}")),
        (_, 1) => Some("it compares runs, and there is one".to_owned()),
        (_, runs) if runs > MOST => Some(format!("it shows {MOST} runs at most, and there are {runs}")),
        _ if table.ok_count() == 0 => Some("no run finished".to_owned()),
        _ => None,
    }
}

/// None: this build draws nothing, and says so.
///
/// # Errors
/// None, as the other one has some.
#[cfg(not(feature = "charts"))]
pub(crate) fn picture_files(_: &str, _: &Columns<'_>, _: &Table) -> Result<Vec<(String, Vec<u8>)>> {
    files::note_without_pictures();
    Ok(Vec::new())
}
