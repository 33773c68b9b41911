//! Rows of a coarser copy of a charted case: its best settings on fewer particles, against the same reference.
//!
//! Enters: a chart and a copy of its case. Leaves: errors (m) at the points that both have in common, and costs.

use super::{
    of_cloth::{Chart, CoarserRows},
    row::Row,
};
use crate::{
    case::{Case, CommonPoints},
    method::{SnowSetting, Stepped},
    quantity::time,
    run::{Cut, Phase, run},
};

/// A coarser copy of a case.
#[derive(Clone, Debug)]
pub struct Coarser {
    /// The copy, which has a name of its own.
    pub case: Case,
    /// The points that it has in common with the case.
    pub points: CommonPoints,
}

/// Adds rows of a coarser copy of its case to a chart: of each setting that no other beats in error and in evaluations and products,
/// and of the scene as it is written, the cheapest first, until a phase is over. `tell` is called with what is done now.
pub fn add_coarser(chart: &mut Chart, copy: &Coarser, phase: &Phase, tell: &dyn Fn(&str)) {
    let Some(reference) = chart.reference.clone() else { return };
    let mut rows = Vec::new();
    for (stepped, dt) in best(&chart.rows) {
        if phase.is_over() {
            chart.is_cut = true;
            chart.is_stopped |= phase.cut() == Cut::Interrupted;
            break;
        }
        let stepped = on_cells(stepped, &copy.case);
        tell(&format!("{}: {} {}, {}", copy.case.name, stepped.name(), stepped.precision(), time(dt)));
        let interval = if stepped.is_own() { copy.case.dt() } else { reference.times.interval };
        let (times, places) = reference.times.coarser(interval);
        let made = run(&copy.case, stepped, &times, phase);
        let mut row = Row::compared(&copy.case, stepped, &made, (&reference, &places), Some(&copy.points));
        chart.is_cut |= row.end.cut().is_some();
        row.mark_below(chart.floor);
        rows.push(row);
    }
    chart.coarser = Some(CoarserRows { name: copy.case.name.clone(), rows });
}

/// The settings of rows that no other row beats in error and counts, and that of the scene as it is written, with the length of their
/// steps (s), the cheapest first. Of snow those on the cells of the scene alone.
fn best(rows: &[Row]) -> Vec<(Stepped, f64)> {
    let cell = rows.iter().find(|row| row.own).and_then(|row| row.stepped.cell());
    let place = |row: &Row| row.error().map(|error| (error, row.count()));
    let is_best = |row: &Row| {
        place(row).is_some_and(|(error, count)| {
            let beats = |other: (f64, u64)| other.0 <= error && other.1 <= count && other != (error, count);
            !rows.iter().filter(|other| other.stepped.cell() == cell).filter_map(place).any(beats)
        })
    };
    let of_scene = rows.iter().filter(|row| row.stepped.cell() == cell);
    let mut best: Vec<&Row> = of_scene.filter(|row| row.own || is_best(row)).collect();
    best.sort_by_key(|row| row.count());
    best.into_iter().map(|row| (row.stepped, row.dt)).collect()
}

/// The same setting on the cells of snow.
fn on_cells(stepped: Stepped, case: &Case) -> Stepped {
    match (stepped, &case.setup.snow) {
        (Stepped::Snow(setting), Some(snow)) => {
            Stepped::Snow(SnowSetting { cell: snow.settings.cell, ..setting })
        }
        _ => stepped,
    }
}
