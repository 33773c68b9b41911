//! A sweep over two keys: the first quantity in colours over both; runs that failed are crossed.

use super::{
    curves::FAILED,
    runs::{Sweep, short},
    values::Values,
};
use crate::{
    axes,
    canvas::{Anchor, Stroke, width},
    hatch,
    look::INK,
    picture::Picture,
    scale::{Scale, Spacing},
    sheet::Sheet,
    style::Style,
    verdicts,
};

/// Width and height of the data (px).
const SIZE: [f64; 2] = [620.0, 420.0];
/// Above, below and at the right of the data (px).
const ABOVE: f64 = 92.0;
const BELOW: f64 = 50.0;
const RIGHT: f64 = 30.0;
/// Where the colours are explained (px).
const LEGEND: f64 = 62.0;
/// Half the side of the mark of a run that has no cell of its own (px).
const MARK: f64 = 5.0;
/// What a cell is filled with whose run failed.
const EMPTY: &str = "#EBEBEB";

/// What a sweep shows that has two keys, across and upwards.
pub(super) fn picture(sweep: &Sweep) -> Result<Picture, String> {
    let (x_values, y_values) = (Values::of(sweep, 0), Values::of(sweep, 1));
    // Samples have a place each; combinations fill the cells of a table.
    let is_table = x_values.count() * y_values.count() <= 2 * sweep.count;
    let scale_of = |values: &Values, places: [f64; 2]| {
        if is_table { values.scale_of(&values.bands(), places) } else { values.scale(places) }
    };
    let [above, below] = [ABOVE, ABOVE + SIZE[1]];
    let y = scale_of(&y_values, [below, above]);
    let y_ticks = y_values.ticks(&y);
    let numbers = y_ticks.iter().filter_map(|tick| tick.number.as_deref());
    let left = 56.0 + numbers.map(width).fold(0.0, f64::max);
    let right = left + SIZE[0];
    let x = scale_of(&x_values, [left, right]);

    let mut sheet = Sheet::new([right + RIGHT, below + BELOW]);
    let title = format!("{}: runs with other values of two keys", sweep.scene);
    sheet.title(&title);
    draw_colours(&mut sheet, sweep, [left, LEGEND]);
    let rooms = if is_table {
        cells(sweep, [(&x_values, x), (&y_values, y)])
    } else {
        marks(sweep, [(&x_values, x), (&y_values, y)])
    };
    draw_runs(&mut sheet, sweep, &rooms);
    sheet.outline([left, right, above, below], "black");
    axes::below(&mut sheet, x_values.ticks(&x), [left, right], below, &sweep.label(0));
    axes::left(&mut sheet, y_ticks, left);
    sheet.label_upwards(&sweep.label(1), [18.0, f64::midpoint(above, below)]);
    sheet.finish("sweep", &title, sweep.sentence(0), &Style::default())
}

/// Left, right, above and below (px) of the cell of each run.
fn cells(sweep: &Sweep, along: [(&Values, Scale); 2]) -> Vec<Option<[f64; 4]>> {
    let bands = along.map(|(values, _)| values.bands());
    // Edges between pixels, so that nothing shows between neighbours.
    let whole = |place: f64| (2.0 * place).round() / 2.0;
    let ends = |run: usize, axis: usize| {
        let (values, scale) = along[axis];
        let number = values.number(sweep.runs[run].value(axis))?;
        Some(bands[axis].band(number)?.map(|edge| whole(scale.place(edge))))
    };
    let room = |run: usize| {
        let ([left, right], [below, above]) = (ends(run, 0)?, ends(run, 1)?);
        // Narrow ones are seen too.
        Some([left, right.max(left + 1.0), above, below.max(above + 1.0)])
    };
    (0..sweep.runs.len()).map(room).collect()
}

/// The same of a mark for each run.
fn marks(sweep: &Sweep, [(x_values, x), (y_values, y)]: [(&Values, Scale); 2]) -> Vec<Option<[f64; 4]>> {
    let runs = sweep.runs.iter();
    let room = runs.map(|run| {
        let (x, y) = (x.at(x_values.number(run.value(0))?), y.at(y_values.number(run.value(1))?));
        Some([x - MARK, x + MARK, y - MARK, y + MARK])
    });
    room.collect()
}

/// Fills the rooms of runs with the colours of the first quantity.
fn draw_runs(sheet: &mut Sheet, sweep: &Sweep, rooms: &[Option<[f64; 4]>]) {
    let spacing = sweep.spacing(0);
    let [low, high] = sweep.ends(0).unwrap_or_default().map(|end| spacing.coordinate(end));
    for (run, room) in sweep.runs.iter().zip(rooms) {
        let Some(room @ [left, right, above, below]) = *room else { continue };
        if let Some(quantity) = run.quantity(0) {
            let share = if high > low { (spacing.coordinate(quantity) - low) / (high - low) } else { 0.5 };
            sheet.rectangle(room, &verdicts::colour(share));
        } else {
            sheet.rectangle(room, EMPTY);
            let middle = [f64::midpoint(left, right), f64::midpoint(above, below)];
            let half = (0.3 * (right - left).min(below - above)).clamp(2.0, 6.0);
            hatch::cross(sheet, middle, half, Stroke { colour: FAILED, width: 1.6, dashes: "" });
        }
    }
}

/// What colours mean, from a place (px) on.
fn draw_colours(sheet: &mut Sheet, sweep: &Sweep, [left, y]: [f64; 2]) {
    let name = sweep.quantities.first().map_or("", String::as_str);
    let Some([low, high]) = sweep.ends(0) else { return };
    let how = if sweep.spacing(0) == Spacing::Log { ", by logarithms" } else { "" };
    let before = format!("{name}{how}: {}", short(low));
    sheet.words(&before, [left, y], Anchor::Start, INK);
    let from = left + width(&before) + 8.0;
    verdicts::draw_colours(sheet, [from, y]);
    sheet.words(&short(high), [from + verdicts::COLOURS + 8.0, y], Anchor::Start, INK);
}
