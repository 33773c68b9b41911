//! The rows of a study of stability as comma-separated values.

use nappe_study::{StabilityRow, Verdict};

use crate::studies::study::csv::{self, known, number};

/// Names of the columns: they stay.
const COLUMNS: [&str; 17] = [
    "scene",
    "method",
    "x_axis",
    "x",
    "y_axis",
    "y",
    "outcome",
    "cause",
    "energy_growth",
    "limit_s",
    "theory_s",
    "stepping",
    "step",
    "particle",
    "bound_s",
    "right_s",
    "cut_reason",
];

/// All rows, with a header.
pub(super) fn text(scene: &str, rows: &[StabilityRow]) -> String {
    csv::text(COLUMNS, rows.iter().map(|row| fields(scene, row)))
}

fn fields(scene: &str, row: &StabilityRow) -> [String; COLUMNS.len()] {
    [
        scene.to_owned(),
        row.method.name(),
        row.over.name().to_owned(),
        if row.is_limit && (row.verdict == Verdict::NotKnown || row.is_refused()) {
            String::new()
        } else {
            number(row.dt)
        },
        row.across.map(|(across, _)| across.name().to_owned()).unwrap_or_default(),
        known(row.across.map(|(_, value)| value)),
        row.verdict.name().to_owned(),
        row.cause.clone().unwrap_or_default(),
        known(row.growth),
        known(row.limit),
        known(row.theory),
        row.stepping.name().to_owned(),
        known(row.step),
        known(row.particle),
        known(row.bound),
        known(row.right),
        row.cut.map(|cut| cut.why().to_owned()).unwrap_or_default(),
    ]
}
