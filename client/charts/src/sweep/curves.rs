//! A sweep over one key: each quantity against it, one above the other; runs that failed are crosses at the lower edge.

use super::{
    runs::Sweep,
    values::{Values, scale},
};
use crate::{
    axes,
    canvas::{Anchor, Stroke},
    hatch,
    look::{self, INK},
    picture::Picture,
    scale::Scale,
    sheet::Sheet,
    style::Style,
};

/// Quantities that are drawn, at most.
const MOST: usize = 8;
/// Width of the picture, and what stays free at both sides of the data (px).
const WIDTH: f64 = 860.0;
const LEFT: f64 = 96.0;
const RIGHT: f64 = 30.0;
/// Above the first panel and below the last (px).
const ABOVE: f64 = 70.0;
const BELOW: f64 = 50.0;
/// Height of a panel, and what lies between two (px).
const HEIGHT: f64 = 190.0;
const GAP: f64 = 34.0;
/// Half the side of a mark (px), and how far crosses are from the edge.
const MARK: f64 = 3.0;
const EDGE: f64 = 8.0;
/// Colour of what failed.
pub(super) const FAILED: &str = "#8B1A1A";

/// What a sweep shows that has one key.
pub(super) fn picture(sweep: &Sweep, key: &str) -> Result<Picture, String> {
    let drawn = sweep.quantities.len().min(MOST);
    let values = Values::of(sweep, 0);
    let bottom = ABOVE + drawn as f64 * (HEIGHT + GAP) - GAP;
    let mut sheet = Sheet::new([WIDTH, bottom + BELOW]);
    let title = format!("{}: runs with other values of {key}", sweep.scene);
    sheet.title(&title);
    let x = values.scale([LEFT, WIDTH - RIGHT]);
    for (place, name) in sweep.quantities.iter().take(MOST).enumerate() {
        let above = ABOVE + place as f64 * (HEIGHT + GAP);
        sheet.words(name, [LEFT, above - 7.0], Anchor::Start, INK);
        draw_panel(&mut sheet, sweep, place, (&values, x), above);
    }
    axes::below(&mut sheet, values.ticks(&x), x.places, bottom, &sweep.label(0));
    let mut sentence = sweep.sentence(0);
    if sweep.quantities.len() > drawn {
        let all = sweep.quantities.len();
        sentence = format!("{sentence} Of {all} quantities the first {drawn} are drawn.");
    }
    sheet.finish("sweep", &title, sentence, &Style::default())
}

/// A quantity against the key, from a height (px) downwards.
fn draw_panel(sheet: &mut Sheet, sweep: &Sweep, place: usize, (values, x): (&Values, Scale), above: f64) {
    let below = above + HEIGHT;
    let look = look::of(place);
    let spacing = sweep.spacing(place);
    let ends = sweep.ends(place).unwrap_or_default().map(|end| spacing.coordinate(end));
    let y = scale(spacing, ends, [below - 2.0 * EDGE, above]);
    let mut points: Vec<(f64, Option<f64>)> = Vec::new();
    for run in &sweep.runs {
        if let Some(number) = values.number(run.value(0)) {
            points.push((x.at(number), run.quantity(place).map(|quantity| y.at(quantity))));
        }
    }
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    if values.are_numbers() {
        // What failed parts the line.
        for part in points.split(|(_, y)| y.is_none()) {
            let line: Vec<[f64; 2]> = part.iter().filter_map(|(x, y)| Some([*x, (*y)?])).collect();
            if line.len() > 1 {
                sheet.line(&line, Stroke { colour: look.colour, width: 1.6, dashes: "" });
            }
        }
    }
    for (x, y) in points {
        match y {
            Some(y) => sheet.rectangle([x - MARK, x + MARK, y - MARK, y + MARK], look.colour),
            None => hatch::cross(
                sheet,
                [x, below - EDGE],
                MARK,
                Stroke { colour: FAILED, width: 1.6, dashes: "" },
            ),
        }
    }
    sheet.outline([LEFT, WIDTH - RIGHT, above, below], "black");
    axes::left(sheet, y.ticks(), LEFT);
}
