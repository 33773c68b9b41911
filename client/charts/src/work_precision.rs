//! Error against cost: each line a method, each mark a run; what is lower and further left is better.

use kuva::plot::scatter::MarkerShape;
use nappe_study::{Chart, Plan, Row, Tried};

use crate::{
    canvas::{Along, Anchor, Axis, Canvas, Fill, Stroke, data_width},
    labels::Labels,
    lines::{self, Line, around},
    look::INK,
    picture::Picture,
    style::Style,
    words::{cheapest_to, error_label, length, time, within},
};

/// What the front is drawn on.
const FRONT: &str = "#F0E442";
/// What errors below the floor are shaded with.
const FLOOR: &str = "#D9D9D9";
/// Colour of reasons why methods were given up.
const REASON: &str = "#8A8A8A";
/// Room for failures at the right (px).
const RAIL: f64 = 26.0;

/// Millimetres, and seconds per simulated second: of an error that cannot be told, what it is at most.
fn point(row: &Row) -> Option<[f64; 2]> {
    Some([row.told()? * 1e3, row.seconds?])
}

pub(crate) fn picture(scene: &str, chart: &Chart, style: &Style) -> Result<Picture, String> {
    let title = format!("{scene}: error against cost, {}", chart.compared());
    drawn(("work_precision", title, sentence(chart)), chart, None, &[], style)
}

/// The rows that a plan tried, with a ring around that which it recommends.
pub(crate) fn planned(scene: &str, plan: &Plan, style: &Style) -> Result<Picture, String> {
    let chart = &plan.chart;
    let tolerance = length(chart.tolerance);
    let title = format!("{scene}: what is cheapest within {tolerance} {}", chart.compared());
    let row = plan.row.as_ref().filter(|_| plan.is_met);
    let answer = row.map_or_else(
        || format!("nothing is within {tolerance}"),
        |row| {
            format!(
                "the ring is {} in {}, {} off",
                within(&row.stepped.reader_name()),
                row.stepped.precision(),
                length(row.error().unwrap_or(0.0))
            )
        },
    );
    let words = format!(
        "Compared {}: of {} runs {answer}. Steps of each line are halved until it is right or would cost more. Filled marks are f64, hollow ones f32; numbers are named below the data.",
        chart.compared(),
        chart.rows.len()
    );
    let reason = |one: &Tried| Some((point(chart.rows.get(one.row?)?)?, one.dropped?.why()));
    let reasons: Vec<_> = plan.tried.iter().filter_map(reason).collect();
    drawn(("plan", title, words), chart, row.and_then(point), &reasons, style)
}

/// A picture by its name, title and sentence, with a ring around a point, and reasons beside others where there is room.
fn drawn(
    (name, title, sentence): (&'static str, String, String),
    chart: &Chart,
    ring: Option<[f64; 2]>,
    reasons: &[([f64; 2], &str)],
    style: &Style,
) -> Result<Picture, String> {
    let [x, y] = axes(chart, style);
    let mut canvas = Canvas::new(name, title, sentence, [x, y], style);
    if chart.floor * 1e3 > x.range[0] {
        canvas.shade(Along::X, [x.range[0], chart.floor * 1e3], FLOOR);
        canvas.mark(Along::X, chart.floor * 1e3);
    }
    draw_front(&mut canvas, chart);
    let lines = lines::of(chart);
    let mut labels = lines::draw(&mut canvas, &lines, chart, &point);
    draw_own(&mut canvas, &mut labels, chart);
    draw_coarser(&mut canvas, &mut labels, chart);
    draw_marks(&mut canvas, &mut labels, chart, [x, y]);
    for line in lines.iter().rev() {
        let is_named = line.look.is_some() && write_ends(&mut canvas, &mut labels, line);
        if !is_named {
            line.number(&mut canvas, &mut labels, &point);
        }
    }
    draw_failures(&mut canvas, &lines, y.range);
    lines::draw_at_most(&mut canvas, &lines, [-1.0, 0.0], &point);
    for (at, reason) in reasons {
        let place = canvas.at(*at);
        labels.write(&mut canvas, reason, place, REASON);
    }
    if let Some(ring) = ring {
        canvas.marks(&[ring], MarkerShape::Circle, "#000000", 11.0, Fill::Hollow);
    }
    canvas.finish()
}

fn axes(chart: &Chart, style: &Style) -> [Axis; 2] {
    let points = || chart.rows.iter().chain(coarser(chart)).filter_map(point);
    let tolerance = std::iter::once(chart.tolerance * 1e3);
    let errors = around(points().map(|[error, _]| error).chain(tolerance));
    let seconds = around(points().map(|[_, seconds]| seconds));
    // The rail of failures takes its share of the width.
    let stretch = (errors[1] / errors[0]).powf(RAIL / (data_width(style) - RAIL));
    [
        Axis { label: error_label(chart), range: [errors[0], errors[1] * stretch], is_log: true },
        Axis { label: "seconds per simulated second", range: seconds, is_log: true },
    ]
}

fn draw_front(canvas: &mut Canvas, chart: &Chart) {
    let mut front: Vec<_> = chart.rows.iter().filter(|row| row.front).filter_map(point).collect();
    front.sort_by(|a, b| a[0].total_cmp(&b[0]));
    if !front.is_empty() {
        canvas.line(&front, Stroke { colour: FRONT, width: 9.0, dashes: "" });
    }
}

fn draw_own(canvas: &mut Canvas, labels: &mut Labels, chart: &Chart) {
    let own = chart.rows.iter().find(|row| row.own).and_then(point);
    if let Some(own) = own {
        canvas.marks(&[own], MarkerShape::Star, "#000000", 10.0, Fill::Full);
        let place = canvas.at(own);
        labels.write(canvas, "as written", place, "#000000");
    }
}

/// Rows of a coarser copy.
fn coarser(chart: &Chart) -> impl Iterator<Item = &Row> {
    chart.coarser.iter().flat_map(|copy| &copy.rows)
}

/// Runs of a coarser copy, with its name beside the nearest.
fn draw_coarser(canvas: &mut Canvas, labels: &mut Labels, chart: &Chart) {
    let points: Vec<[f64; 2]> = coarser(chart).filter_map(point).collect();
    let Some(nearest) = points.iter().min_by(|a, b| a[0].total_cmp(&b[0])) else { return };
    canvas.marks(&points, MarkerShape::Plus, INK, 7.0, Fill::Full);
    for at in &points {
        labels.keep_off(canvas.at(*at));
    }
    let place = canvas.at(*nearest);
    labels.write(canvas, "coarser copy", place, INK);
}

/// The tolerance and real time, and what the floor is.
fn draw_marks(canvas: &mut Canvas, labels: &mut Labels, chart: &Chart, [x, y]: [Axis; 2]) {
    let [left, _, above, below] = canvas.frame();
    let tolerance = chart.tolerance * 1e3;
    canvas.mark(Along::X, tolerance);
    let at = [canvas.at([tolerance, y.range[0]])[0], below - 8.0];
    labels.write(canvas, &format!("tolerance, {}", length(chart.tolerance)), at, INK);
    if (y.range[0]..y.range[1]).contains(&1.0) {
        canvas.mark(Along::Y, 1.0);
        let at = [left, canvas.at([x.range[0], 1.0])[1] - 6.0];
        labels.write(canvas, "real time", at, INK);
    }
    if chart.floor * 1e3 > x.range[0] {
        labels.write(canvas, &lines::floor(chart), [left, above + 14.0], INK);
    }
}

/// The name of a line at its finest end, and the length of its steps at both, if there is room; says whether its name is there.
fn write_ends(canvas: &mut Canvas, labels: &mut Labels, line: &Line<'_>) -> bool {
    let held: Vec<_> = line.rows.iter().filter_map(|row| Some((row, point(row)?))).collect();
    let (Some((coarse, first)), Some((fine, last))) = (held.first(), held.last()) else { return false };
    if canvas.is_narrow() {
        return false;
    }
    let [first, last] = [canvas.at(*first), canvas.at(*last)];
    let name = format!("{}, {}", line.title(), time(fine.dt));
    let is_named = labels.write(canvas, &name, last, line.colour())
        || labels.write(canvas, &line.title(), last, line.colour());
    if held.len() > 1 {
        labels.write(canvas, &time(coarse.dt), first, line.colour());
    }
    is_named
}

/// A cross for each run that failed, at what it cost.
fn draw_failures(canvas: &mut Canvas, lines: &[Line<'_>], [low, high]: [f64; 2]) {
    let [_, right, above, below] = canvas.frame();
    let x = right - 0.5 * RAIL;
    let mut has_any = false;
    for line in lines {
        for seconds in
            line.rows.iter().filter(|row| row.end.failure().is_some()).filter_map(|row| row.seconds)
        {
            let y = canvas.at([1.0, seconds.clamp(low, high)])[1];
            canvas.cross([x, y.clamp(above + 5.0, below - 5.0)], line.colour());
            has_any = true;
        }
    }
    if has_any {
        canvas.segment([[right - RAIL, above], [right - RAIL, below]], FLOOR, 1.0);
        canvas.words("failed", [right - 1.0, above - 4.0], Anchor::End, INK);
    }
}

fn sentence(chart: &Chart) -> String {
    let failed = chart.rows.iter().filter(|row| row.end.failure().is_some()).count();
    let own = chart.rows.iter().find(|row| row.own).map_or_else(String::new, |own| match own.error() {
        Some(error) => format!("; as written the scene is {} off", length(error)),
        None => "; as written it fails".to_owned(),
    });
    let cells = chart.reference.as_ref().and_then(|reference| Some((reference, reference.stepped.cell()?)));
    let floor = cells.map_or_else(String::new, |(reference, cell)| {
        format!(
            " The reference has cells of {} and is known to {}: what is nearer to it is not ranked.",
            length(cell),
            length(reference.error())
        )
    });
    let below = chart.rows.iter().filter(|row| row.at_most.is_some()).count();
    let below = if below > 0 { " Marks with an arrow are at most as far off as they say." } else { "" };
    let copy = chart.coarser.as_ref().map_or_else(String::new, |copy| {
        format!(" Plus signs are the copy {}, compared at the points in common.", copy.name)
    });
    format!(
        "Compared {}: of {} runs {failed} failed; {}{own}. Filled marks are f64, hollow ones f32; the band is the front, what no other run beats in both; grey lines are the other methods; numbers are named below the data.{floor}{below}{copy}",
        chart.compared(),
        chart.rows.len(),
        cheapest_to(&chart.rows, chart.tolerance)
    )
}
