//! The predictability horizon of a scene: the spread of runs that start 1e-8 m apart, and the reference's own error.

use nappe_study::{Chart, DISPLACEMENT, Measure};

use crate::{
    canvas::{Along, Anchor, Axis, Canvas, Stroke},
    key::Sample,
    labels::Labels,
    lines::around,
    look::{self, INK},
    picture::Picture,
    style::Style,
    words::{length, moment, number},
};

/// What the window is shaded with.
const SHADE: &str = "#DCEBF5";
/// The smallest length that is drawn (mm): rounding is below it.
const LEAST: f64 = 1e-10;

/// Whether there is anything to be drawn: the spread of copies, or the own error of a reference of snow. What is not the motion has no
/// predictability horizon.
pub(crate) fn is_known(chart: &Chart) -> bool {
    let is_motion = chart.measure == Measure::Motion;
    let has_spread = is_motion && !chart.scan.spread.is_empty();
    has_spread || chart.reference.as_ref().is_some_and(|known| known.stepped.cell().is_some())
}

pub(crate) fn picture(scene: &str, chart: &Chart, style: &Style) -> Result<Picture, String> {
    let scan = &chart.scan;
    let spread: Vec<_> = scan
        .spread
        .iter()
        .enumerate()
        .map(|(i, spread)| [scan.spacing * (i + 1) as f64, (spread * 1e3).max(LEAST)])
        .collect();
    let error: Vec<_> = chart
        .whole
        .iter()
        .flat_map(|reference| {
            let times = reference.times.marks.iter().map(|mark| reference.times.time(*mark));
            times.zip(&reference.own_error).map(|(time, error)| [time, (error * 1e3).max(LEAST)])
        })
        .collect();
    let quarter = 0.25 * chart.tolerance * 1e3;
    let both = || spread.iter().chain(&error);
    let end = both().map(|point| point[0]).fold(0.0, f64::max);
    let lengths = around(both().map(|point| point[1]).chain([quarter]));
    let x = Axis { label: "time (s)", range: [0.0, end * 1.02], is_log: false };
    let y = Axis { label: "rms distance (mm)", range: lengths, is_log: true };
    let title = if spread.is_empty() {
        format!("{scene}: what its cells leave open")
    } else {
        format!("{scene}: predictability horizon for a displacement of 1e-8 m")
    };
    let mut canvas = Canvas::new("window", title, sentence(chart), [x, y], style);
    if chart.until() > 0.0 {
        canvas.shade(Along::X, [0.0, chart.until()], SHADE);
    }
    canvas.mark(Along::Y, quarter);
    let mut labels = Labels::default();
    for (points, number, name) in [(&spread, 1, "spread of copies"), (&error, 0, "the reference's own error")]
    {
        let look = look::of(number);
        if points.is_empty() {
            continue;
        }
        canvas.line(points, Stroke { colour: look.colour, width: 2.0, dashes: look.dashes });
        let middle = points[points.len() / 2];
        let place = canvas.at(middle);
        if canvas.is_narrow() {
            let sample = Sample { mark: None, ..Sample::of(Some(look)) };
            let number = canvas.key.number(name, sample);
            labels.number(&mut canvas, number, &[place], look.colour);
        } else {
            canvas.words(name, [place[0] - 8.0, place[1] - 8.0], Anchor::End, look.colour);
        }
    }
    let [_, right, ..] = canvas.frame();
    let at = canvas.at([0.0, quarter]);
    canvas.words(
        &format!("a quarter of the tolerance, {}", length(0.25 * chart.tolerance)),
        [right - 6.0, at[1] - 5.0],
        Anchor::End,
        INK,
    );
    canvas.finish()
}

fn sentence(chart: &Chart) -> String {
    let cell = chart.reference.as_ref().and_then(|reference| Some((reference, reference.stepped.cell()?)));
    if let Some((reference, cell)) = cell {
        return format!(
            "Runs are compared until {}, shaded. The reference has cells of {} and is known to {}: as far as it is from the run before, on cells twice as long, or less where three runs show an order.",
            moment(chart.until()),
            length(cell),
            length(reference.error())
        );
    }
    let grown = chart.scan.largest_until(chart.until()) / DISPLACEMENT;
    let (until, rate) = (chart.until(), chart.growth_rate());
    if until == 0.0 {
        return "Copies that start 1e-8 m away part before the first time: nothing can be compared."
            .to_owned();
    }
    format!(
        "Runs are compared until {}, shaded: copies that start 1e-8 m away are by then at most {} times as far{}; the reference's own error is at most {}.",
        moment(until),
        number(grown),
        rate.map_or_else(String::new, |rate| format!(", at a mean growth rate of {} 1/s", number(rate))),
        chart.reference.as_ref().map_or_else(String::new, |reference| length(reference.error()))
    )
}
