//! Error against the length of steps: the slope of a line is the order of its method.

use nappe_study::{Chart, Row};

use crate::{
    canvas::{Along, Anchor, Axis, Canvas},
    lines::{self, around},
    look::INK,
    picture::Picture,
    style::Style,
    words::{error_label, length, time, within},
};

/// What errors below the floor are shaded with.
const FLOOR: &str = "#D9D9D9";

/// Milliseconds and millimetres, of steps that are all alike: of an error that cannot be told, what it is at most.
fn point(row: &Row) -> Option<[f64; 2]> {
    row.stepped.is_even().then_some([row.dt * 1e3, row.told()? * 1e3])
}

pub(crate) fn picture(scene: &str, chart: &Chart, style: &Style) -> Result<Picture, String> {
    let points = || chart.rows.iter().filter_map(point);
    let tolerance = chart.tolerance * 1e3;
    let x = Axis { label: "step (ms)", range: around(points().map(|[dt, _]| dt)), is_log: true };
    let errors = around(points().map(|[_, error]| error).chain(std::iter::once(tolerance)));
    let y = Axis { label: error_label(chart), range: errors, is_log: true };
    let title = format!("{scene}: error against step, {}", chart.compared());
    let mut canvas = Canvas::new("convergence", title, sentence(chart), [x, y], style);
    if chart.floor * 1e3 > errors[0] {
        canvas.shade(Along::Y, [errors[0], chart.floor * 1e3], FLOOR);
        canvas.mark(Along::Y, chart.floor * 1e3);
    }

    let mut lines = lines::of(chart);
    lines.retain(|line| line.rows.iter().any(|row| point(row).is_some()));
    let mut labels = lines::draw(&mut canvas, &lines, chart, &point);
    let [left, _, above, _] = canvas.frame();
    canvas.mark(Along::Y, tolerance);
    let at = [left, canvas.at([x.range[0], tolerance])[1] - 6.0];
    labels.write(&mut canvas, &format!("tolerance, {}", length(chart.tolerance)), at, INK);
    if chart.floor * 1e3 > errors[0] {
        let at = [left, canvas.at([x.range[0], chart.floor * 1e3])[1] - 6.0];
        labels.write(&mut canvas, &lines::floor(chart), at, INK);
    }
    let bound = chart.scan.bound * 1e3;
    if (x.range[0]..x.range[1]).contains(&bound) {
        canvas.mark(Along::X, bound);
        let at = [canvas.at([bound, errors[0]])[0], above + 14.0];
        labels.write(&mut canvas, &format!("certified bound, {}", time(chart.scan.bound)), at, INK);
    }
    draw_slopes(&mut canvas);
    for line in lines.iter().rev() {
        let finest = line.rows.iter().rev().find_map(|row| point(row)).map(|point| canvas.at(point));
        let named = finest.filter(|_| line.look.is_some() && !canvas.is_narrow());
        let is_named =
            named.is_some_and(|place| labels.write(&mut canvas, &line.title(), place, line.colour()));
        if !is_named {
            line.number(&mut canvas, &mut labels, &point);
        }
    }
    lines::draw_at_most(&mut canvas, &lines, [0.0, 1.0], &point);
    canvas.finish()
}

/// Triangles of slope 1 and 2, half a decade wide.
fn draw_slopes(canvas: &mut Canvas) {
    let [left, right, _, below] = canvas.frame();
    let decade = canvas.decade();
    // Two of them and their numbers fit between the sides.
    let share = f64::min(0.4, (0.5 * (right - left) - 55.0) / decade[0]);
    let width = share * decade[0];
    for (order, x) in [(1.0, right - 2.0 * width - 70.0), (2.0, right - width - 30.0)] {
        let [y, height] = [below - 12.0, share * order * decade[1]];
        canvas.segment([[x, y], [x + width, y]], INK, 1.2);
        canvas.segment([[x + width, y], [x + width, y - height]], INK, 1.2);
        canvas.segment([[x, y], [x + width, y - height]], INK, 1.2);
        canvas.words(&format!("{order}"), [x + width + 4.0, y - 0.5 * height + 4.0], Anchor::Start, INK);
    }
}

fn sentence(chart: &Chart) -> String {
    let implicit = chart.other_family().and_then(|row| Some((row, row.error()?)));
    let near = implicit.map_or_else(String::new, |(row, error)| {
        format!(
            " The nearest implicit run, {} in {} with steps of {}, comes within {} of it.",
            within(&row.stepped.reader_name()),
            row.stepped.precision(),
            time(row.dt),
            length(error)
        )
    });
    let reference = chart.reference.as_ref().map_or_else(String::new, |reference| {
        format!(
            "The reference makes steps of {} and knows its answer to {}.",
            time(reference.step),
            length(reference.error())
        )
    });
    format!(
        "Runs are compared {}. {reference}{near} Filled marks are f64, hollow ones f32; numbers are named below the data; triangles have the slopes of order 1 and 2.",
        chart.compared()
    )
}
