//! What a scene can do without: how far the answer moves without each of its terms, against the time that is saved.

use kuva::plot::scatter::MarkerShape;
use nappe_study::{Plan, Term};

use crate::{
    canvas::{Along, Axis, Canvas, Fill},
    labels::Labels,
    lines::around,
    look::{GREY, INK},
    picture::Picture,
    style::Style,
    words::{length, listed},
};

/// Colours of what can go and of what is needed.
const GONE: &str = "#009E73";
const NEEDED: &str = "#D55E00";
/// The smallest change that is drawn (mm).
const LEAST: f64 = 1e-9;

/// Percent of the time, and millimetres.
fn point(term: &Term) -> Option<[f64; 2]> {
    Some([100.0 * term.saving?, (term.change? * 1e3).max(LEAST)])
}

pub(crate) fn picture(scene: &str, plan: &Plan, style: &Style) -> Result<Picture, String> {
    let points = || plan.terms.iter().filter_map(point);
    let tolerance = plan.chart.tolerance * 1e3;
    let savings = points().map(|[saving, _]| saving);
    let [low, high] = savings.fold([0.0, 0.0], |[low, high], s| [f64::min(low, s), f64::max(high, s)]);
    let x = Axis { label: "time saved (%)", range: [low - 3.0, high + 12.0], is_log: false };
    let changes = around(points().map(|[_, change]| change).chain([tolerance]));
    let y = Axis { label: "the answer moves by (mm)", range: changes, is_log: true };
    let title = format!("{scene}: what it can do without");
    let mut canvas = Canvas::new("terms", title, sentence(plan), [x, y], style);
    canvas.mark(Along::Y, tolerance);
    let mut labels = Labels::default();
    let [left, ..] = canvas.frame();
    let at = [left, canvas.at([x.range[0], tolerance])[1] - 6.0];
    labels.write(&mut canvas, &format!("tolerance, {}", length(plan.chart.tolerance)), at, INK);
    for term in &plan.terms {
        let Some(at) = point(term) else { continue };
        let (colour, shape, fill) = match (term.is_left_out, term.is_needed) {
            (true, _) => (GONE, MarkerShape::Circle, Fill::Hollow),
            (false, true) => (NEEDED, MarkerShape::Square, Fill::Full),
            (false, false) => (GREY, MarkerShape::Triangle, Fill::Full),
        };
        canvas.marks(&[at], shape, colour, 6.0, fill);
        let place = canvas.at(at);
        labels.keep_off(place);
        if !labels.write(&mut canvas, &term.name, place, INK) {
            let number = canvas.key.number(&term.name, colour, "");
            labels.number(&mut canvas, number, &[place], INK);
        }
    }
    canvas.finish()
}

fn sentence(plan: &Plan) -> String {
    let gone: Vec<String> =
        plan.terms.iter().filter(|term| term.is_left_out).map(|term| term.name.clone()).collect();
    let tolerance = length(plan.chart.tolerance);
    let answer = match plan.together_change {
        Some(change) => format!(
            "Together {} can go: without them the answer moves by {}, and stays within {tolerance}.",
            listed(&gone),
            if change == 0.0 { "nothing".to_owned() } else { length(change) }
        ),
        None if plan.is_terms_cut => "Nothing is left out: out of time.".to_owned(),
        None => {
            format!("No term can go: each moves the answer by more than its error leaves of {tolerance}.")
        }
    };
    format!(
        "{answer} Hollow circles can go, filled squares are needed, triangles are small alone, and not together."
    )
}
