//! The lines of a chart: rows of one method in one precision, of snow on cells of one length, and which of them are named.

use std::cmp::Reverse;

use nappe_sim::math::Precision;
use nappe_study::{Chart, Row};

use crate::{
    canvas::{Canvas, Fill, Stroke},
    key::Sample,
    labels::Labels,
    look::{self, GREY, Look, NAMED, NUMBER},
    words::length,
};

/// Rows of one method in one precision, of snow on cells of one length.
pub(crate) struct Line<'a> {
    /// That of the method for readers; of snow with the length of its cells.
    pub(crate) name: String,
    precision: Precision,
    pub(crate) rows: Vec<&'a Row>,
    /// Of a line that is named.
    pub(crate) look: Option<Look>,
}

/// All lines, those that are named last: they are drawn above the others.
pub(crate) fn of(chart: &Chart) -> Vec<Line<'_>> {
    let mut lines: Vec<Line<'_>> = Vec::new();
    for row in chart.rows.iter().filter(|row| !row.own) {
        let (name, precision) = (name(row), row.stepped.precision());
        match lines.last_mut().filter(|line| line.name == name && line.precision == precision) {
            Some(line) => line.rows.push(row),
            None => lines.push(Line { name, precision, rows: vec![row], look: None }),
        }
    }

    // Those that the front is made of, then those that come nearest.
    let rank = |line: &Line<'_>| {
        let front = line.rows.iter().filter(|row| row.front).count();
        let best = line.rows.iter().filter_map(|row| row.error()).fold(f64::INFINITY, f64::min);
        (Reverse(front), best.to_bits())
    };
    lines.sort_by_key(rank);
    let mut methods: Vec<String> = Vec::new();
    for line in lines.iter_mut().take(NAMED).filter(|line| line.rows.iter().any(|row| row.error().is_some()))
    {
        if !methods.contains(&line.name) {
            methods.push(line.name.clone());
        }
        let number = methods.iter().position(|name| *name == line.name).unwrap_or(0);
        line.look = Some(look::of(number));
    }
    lines.reverse();
    lines
}

fn name(row: &Row) -> String {
    let name = row.stepped.reader_name();
    row.stepped.cell().map_or_else(|| name.clone(), |cell| format!("{name}, {}", length(cell)))
}

impl Line<'_> {
    /// Its name with the precision.
    pub(crate) fn title(&self) -> String {
        format!("{}, {}", self.name, self.precision)
    }

    pub(crate) fn colour(&self) -> &'static str {
        self.look.map_or(GREY, |look| look.colour)
    }

    /// Draws the line and its marks, where `point` says that rows are.
    pub(crate) fn draw(&self, canvas: &mut Canvas, point: &dyn Fn(&Row) -> Option<[f64; 2]>) {
        let points: Vec<[f64; 2]> = self.rows.iter().filter_map(|row| point(row)).collect();
        if points.is_empty() {
            return;
        }
        trace(canvas, (self.look, self.precision), &points, &points);
    }

    /// Writes the number of its method at the finest of its points that has room, and what it means into the key: of a line
    /// that has points, and no name beside them.
    pub(crate) fn number(
        &self,
        canvas: &mut Canvas,
        labels: &mut Labels,
        point: &dyn Fn(&Row) -> Option<[f64; 2]>,
    ) {
        let finest_first = self.rows.iter().rev().filter_map(|row| point(row));
        let places: Vec<[f64; 2]> = finest_first.map(|point| canvas.at(point)).collect();
        if places.is_empty() {
            return;
        }
        let number = canvas.key.number(&self.name, Sample::of(self.look));
        labels.number(canvas, number, &places, self.look.map_or(NUMBER, |look| look.colour));
    }
}

/// Draws lines where `point` says that rows are, and keeps labels off all of these points.
pub(crate) fn draw(
    canvas: &mut Canvas,
    lines: &[Line<'_>],
    chart: &Chart,
    point: &dyn Fn(&Row) -> Option<[f64; 2]>,
) -> Labels {
    for line in lines {
        line.draw(canvas, point);
    }
    let mut labels = Labels::default();
    for place in chart.rows.iter().filter_map(point) {
        labels.keep_off(canvas.at(place));
    }
    labels
}

/// Arrows from the marks of rows whose error is known as at most what these say, in the direction of less, along and down.
pub(crate) fn draw_at_most(
    canvas: &mut Canvas,
    lines: &[Line<'_>],
    less: [f64; 2],
    point: &dyn Fn(&Row) -> Option<[f64; 2]>,
) {
    for line in lines {
        let below = line.rows.iter().filter(|row| row.at_most.is_some());
        for point in below.filter_map(|row| point(row)) {
            let place = canvas.at(point);
            arrow(canvas, place, less, line.colour());
        }
    }
}

/// An arrow that begins beside a place (px).
fn arrow(canvas: &mut Canvas, [x, y]: [f64; 2], [along, down]: [f64; 2], colour: &str) {
    let [from, to] = [6.0, 16.0].map(|far| [x + far * along, y + far * down]);
    canvas.segment([from, to], colour, 1.2);
    for side in [-3.0, 3.0] {
        let back = [to[0] - 4.0 * along + side * down, to[1] - 4.0 * down + side * along];
        canvas.segment([to, back], colour, 1.2);
    }
}

/// What the line at the floor of a chart is: the own error of its reference, where no spread of copies is larger.
pub(crate) fn floor(chart: &Chart) -> String {
    let is_own = chart.reference.as_ref().is_some_and(|reference| reference.error() >= chart.floor);
    let what = if is_own { "the reference's own error" } else { "what can be told" };
    format!("{what}, {}", length(chart.floor))
}

/// Draws a line through points and marks at others, in a look if it is named, full in f64.
pub(crate) fn trace(
    canvas: &mut Canvas,
    (look, precision): (Option<Look>, Precision),
    points: &[[f64; 2]],
    marks: &[[f64; 2]],
) {
    let (width, size) = if look.is_some() { (1.8, 4.5) } else { (1.0, 2.5) };
    let look = look.unwrap_or(Look { colour: GREY, dashes: "", ..look::of(0) });
    canvas.line(points, Stroke { colour: look.colour, width, dashes: look.dashes });
    let fill = if precision == Precision::F64 { Fill::Full } else { Fill::Hollow };
    canvas.marks(marks, look.mark, look.colour, size, fill);
}

/// What a logarithmic axis holds: powers of ten from and to, and how many from its high end down. The plotter draws nothing below
/// the first.
const POWERS: [f64; 2] = [-10.0, 300.0];
const DECADES: f64 = 30.0;

/// The decades around numbers, as far as an axis can hold them: others stand at its ends.
pub(crate) fn around(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let positive = values.filter(|value| value.is_finite() && *value > 0.0);
    let [low, high] = positive
        .fold([f64::INFINITY, 0.0], |[low, high], value| [f64::min(low, value), f64::max(high, value)]);
    if low > high {
        return [0.1, 10.0];
    }
    let [least, most] = POWERS;
    let [low, high] = [low, high].map(|value| value.log10().clamp(least, most));
    // At least a decade, with room at both ends.
    let [low, high] = [low.max(high - DECADES) - 0.15, high + 0.15];
    let spare = (0.5 * (1.0 - (high - low))).max(0.0);
    [10_f64.powf(low - spare), 10_f64.powf(high + spare)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_holds_what_numbers_there_are_within_thirty_decades() {
        let decades = |values: &[f64]| around(values.iter().copied()).map(f64::log10);
        let near = |found: [f64; 2], expected: [f64; 2]| {
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?} {expected:?}");
        };
        near(decades(&[1e-3, 10.0]), [-3.15, 1.15]);
        near(decades(&[1.0]), [-0.5, 0.5]);
        near(decades(&[]), [-1.0, 1.0]);
        near(decades(&[f64::NAN, f64::INFINITY, -1.0, 0.0, 1.0, 100.0]), [-0.15, 2.15]);
        near(decades(&[f64::MIN_POSITIVE, 1.0]), [-10.15, 0.15]);
        near(decades(&[1.0, f64::MAX]), [269.85, 300.15]);
    }
}
