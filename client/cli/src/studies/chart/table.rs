//! The rows of a chart as comma-separated values.

use nappe_study::{Chart, Cut, End, Row};

use crate::studies::study::csv::{self, known, number};

/// Names of the columns: they stay.
const COLUMNS: [&str; 24] = [
    "scene",
    "method",
    "precision",
    "threads",
    "dt",
    "tolerance",
    "rms_error_m",
    "seconds_per_simulated_second",
    "force_evaluations",
    "matrix_products",
    "outcome",
    "step_tolerance_m",
    "centre_error_m",
    "minimum_seconds",
    "energy_drift_j",
    "max_stretch",
    "cause",
    "failed_at_s",
    "particle",
    "below_floor",
    "front",
    "own",
    "cell_m",
    "cut_reason",
];

/// All rows, with a header; those of a coarser copy last, by its name.
pub(crate) fn text(scene: &str, threads: usize, chart: &Chart) -> String {
    let copies =
        chart.coarser.iter().flat_map(|copy| copy.rows.iter().map(move |row| (copy.name.as_str(), row)));
    let rows = chart.rows.iter().map(|row| (scene, row)).chain(copies);
    csv::text(COLUMNS, rows.map(|(scene, row)| fields(scene, threads, row)))
}

fn fields(scene: &str, threads: usize, row: &Row) -> [String; COLUMNS.len()] {
    let failure = row.end.failure();
    // How far a run came that was given up is a matter of time, or of what others cost.
    let is_known = matches!(row.end, End::Reached | End::Failed(_));
    let told = |value: f64| if is_known { number(value) } else { String::new() };
    let counted = |value: u64| if is_known { value.to_string() } else { String::new() };
    [
        scene.to_owned(),
        row.stepped.name(),
        row.stepped.precision().to_string(),
        threads.to_string(),
        if is_known || row.stepped.is_even() { number(row.dt) } else { String::new() },
        known(row.tolerance),
        known(row.rms_error),
        known(row.seconds.filter(|_| is_known)),
        counted(row.work.force_evaluations),
        counted(row.work.matrix_products),
        row.end.name().to_owned(),
        known(row.stepped.step_tolerance()),
        known(row.centre_error),
        known(row.minimum_seconds.filter(|_| is_known)),
        told(row.energy_drift),
        told(row.max_stretch),
        failure.map(|failure| failure.cause.clone()).unwrap_or_default(),
        known(failure.map(|failure| failure.time)),
        known(failure.and_then(|failure| failure.particle)),
        row.below_floor.to_string(),
        row.front.to_string(),
        row.own.to_string(),
        known(row.stepped.cell()),
        row.end.cut().map(Cut::why).unwrap_or_default().to_owned(),
    ]
}
