//! How the cells of maps are told apart: by colour, by a sign. In grey the sign remains.

use kuva::plot::colormap::ColorMap;
use nappe_study::Verdict;

use crate::{
    canvas::{Anchor, Stroke},
    hatch,
    sheet::Sheet,
};

/// Width of the colours beside their numbers (px), and how many there are.
pub(crate) const COLOURS: f64 = 160.0;
const SHADES: u32 = 80;
/// Decades of growth at both ends of the colours.
pub(crate) const GROWTH: [f64; 2] = [-3.0, 1.0];
/// Share of the colours from which on they are light.
const LIGHT: f64 = 0.55;
/// The smallest cell (px) that has a sign.
const LEAST: f64 = 9.0;

/// Verdicts on cells, as a legend lists them.
pub(crate) const ALL: [Verdict; 7] = [
    Verdict::Stable,
    Verdict::Wrong,
    Verdict::Grows,
    Verdict::Diverged,
    Verdict::Indefinite,
    Verdict::Refused,
    Verdict::NotKnown,
];

/// Whether nothing is known of the method.
pub(crate) const fn is_unknown(verdict: Verdict) -> bool {
    matches!(verdict, Verdict::Refused | Verdict::NotKnown)
}

/// A growth that runs with a verdict often have, for legends.
pub(crate) fn example(verdict: Verdict) -> f64 {
    if verdict == Verdict::Grows { 2.0 } else { 0.01 }
}

/// Where a growth is among the colours, from 0 to 1.
fn share(growth: Option<f64>) -> f64 {
    let decades = growth.map_or(GROWTH[0], |growth| growth.max(f64::MIN_POSITIVE).log10());
    ((decades - GROWTH[0]) / (GROWTH[1] - GROWTH[0])).clamp(0.0, 1.0)
}

/// The colour at a share of the way from the least growth to the greatest.
pub(crate) fn colour(share: f64) -> String {
    ColorMap::Viridis.map(share)
}

/// Draws all colours from the least to the greatest beside words that begin at a place (px).
pub(crate) fn draw_colours(sheet: &mut Sheet, [from, y]: [f64; 2]) {
    let slice = COLOURS / f64::from(SHADES);
    for shade in 0..SHADES {
        let place = from + slice * f64::from(shade);
        let colour = colour((f64::from(shade) + 0.5) / f64::from(SHADES));
        sheet.rectangle([place, place + slice, y - 10.0, y + 2.0], &colour);
    }
}

/// Draws a cell (left, right, above, below) of a run that grew so, with its sign if there is room.
pub(crate) fn draw(sheet: &mut Sheet, room: [f64; 4], verdict: Verdict, growth: Option<f64>) {
    // What grows beyond numbers has the last colour.
    let share = share(growth.or((verdict == Verdict::Grows).then_some(f64::INFINITY)));
    let shaded = || (colour(share), if share < LIGHT { "white" } else { "black" });
    let (fill, ink) = match verdict {
        Verdict::Stable
        | Verdict::Survived
        | Verdict::Recovered
        | Verdict::Wrong
        | Verdict::Grows
        | Verdict::Lost => shaded(),
        Verdict::Diverged | Verdict::Detected => ("#8B1A1A".to_owned(), "white"),
        Verdict::Indefinite => ("#CC79A7".to_owned(), "black"),
        Verdict::Refused => ("#C4C4C4".to_owned(), "black"),
        Verdict::NotKnown | Verdict::Warned | Verdict::None => ("#FFFFFF".to_owned(), "black"),
    };
    sheet.rectangle(room, &fill);
    let [left, right, above, below] = room;
    let size = (right - left).min(below - above);
    if size >= LEAST {
        let middle = [f64::midpoint(left, right), f64::midpoint(above, below)];
        draw_sign(sheet, verdict, middle, (0.25 * size).clamp(2.2, 4.0), ink);
    }
}

/// The sign of a verdict about a place (px), so wide on each side of it.
fn draw_sign(sheet: &mut Sheet, verdict: Verdict, [x, y]: [f64; 2], half: f64, ink: &str) {
    let stroke = Stroke { colour: ink, width: 1.1, dashes: "" };
    let across = [[x - half, y], [x + half, y]];
    match verdict {
        Verdict::Grows | Verdict::Lost => {
            sheet.line(&across, stroke);
            sheet.line(&[[x, y - half], [x, y + half]], stroke);
        }
        Verdict::Wrong => {
            let wave = [[-1.0, 0.2], [-0.5, -0.5], [0.5, 0.5], [1.0, -0.2]];
            sheet.line(&wave.map(|[dx, dy]| [x + dx * half, y + dy * half]), stroke);
        }
        Verdict::Diverged | Verdict::Detected => hatch::cross(sheet, [x, y], 0.8 * half, stroke),
        Verdict::Indefinite => sheet.line(&across, stroke),
        Verdict::Refused => sheet.words("r", [x, y + 3.0], Anchor::Middle, ink),
        Verdict::Stable
        | Verdict::Survived
        | Verdict::Recovered
        | Verdict::NotKnown
        | Verdict::Warned
        | Verdict::None => {}
    }
}
