//! How the cells of maps are told apart: by colour, by a sign. In grey the sign remains.

use kuva::plot::colormap::ColorMap;
use nappe_study::Fate;

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

/// What a cell shows of the fate of its run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    Stable,
    Wrong,
    Grows,
    Diverged,
    Indefinite,
    Refused,
    NotKnown,
}

impl Outcome {
    /// All of them, as a legend lists them.
    pub(crate) const ALL: [Self; 7] = [
        Self::Stable,
        Self::Wrong,
        Self::Grows,
        Self::Diverged,
        Self::Indefinite,
        Self::Refused,
        Self::NotKnown,
    ];

    /// That of a fate.
    pub(crate) const fn of(fate: Fate) -> Self {
        match fate {
            Fate::Stable | Fate::Survived | Fate::Recovered => Self::Stable,
            Fate::Wrong => Self::Wrong,
            Fate::Grows | Fate::Lost => Self::Grows,
            Fate::Diverged | Fate::Detected => Self::Diverged,
            Fate::Indefinite => Self::Indefinite,
            Fate::Refused => Self::Refused,
            Fate::NotKnown => Self::NotKnown,
        }
    }

    /// Its name in legends.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Stable => "stable",
            Self::Wrong => "wrong",
            Self::Grows => "grows",
            Self::Diverged => "diverged",
            Self::Indefinite => "indefinite",
            Self::Refused => "refused",
            Self::NotKnown => "not known",
        }
    }

    /// Whether the method failed.
    pub(crate) const fn is_failure(self) -> bool {
        matches!(self, Self::Grows | Self::Diverged | Self::Indefinite)
    }

    /// Whether nothing is known of the method.
    pub(crate) const fn is_unknown(self) -> bool {
        matches!(self, Self::Refused | Self::NotKnown)
    }

    /// A growth that such runs often have, for legends.
    pub(crate) const fn example(self) -> f64 {
        match self {
            Self::Grows => 2.0,
            _ => 0.01,
        }
    }
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
pub(crate) fn draw(sheet: &mut Sheet, room: [f64; 4], outcome: Outcome, growth: Option<f64>) {
    // What grows beyond numbers has the last colour.
    let share = share(growth.or((outcome == Outcome::Grows).then_some(f64::INFINITY)));
    let shaded = || (colour(share), if share < LIGHT { "white" } else { "black" });
    let (fill, ink) = match outcome {
        Outcome::Stable | Outcome::Wrong | Outcome::Grows => shaded(),
        Outcome::Diverged => ("#8B1A1A".to_owned(), "white"),
        Outcome::Indefinite => ("#CC79A7".to_owned(), "black"),
        Outcome::Refused => ("#C4C4C4".to_owned(), "black"),
        Outcome::NotKnown => ("#FFFFFF".to_owned(), "black"),
    };
    sheet.rectangle(room, &fill);
    let [left, right, above, below] = room;
    let size = (right - left).min(below - above);
    if size >= LEAST {
        let middle = [f64::midpoint(left, right), f64::midpoint(above, below)];
        draw_sign(sheet, outcome, middle, (0.25 * size).clamp(2.2, 4.0), ink);
    }
}

/// The sign of an outcome about a place (px), so wide on each side of it.
fn draw_sign(sheet: &mut Sheet, outcome: Outcome, [x, y]: [f64; 2], half: f64, ink: &str) {
    let stroke = Stroke { colour: ink, width: 1.1, dashes: "" };
    let across = [[x - half, y], [x + half, y]];
    match outcome {
        Outcome::Grows => {
            sheet.line(&across, stroke);
            sheet.line(&[[x, y - half], [x, y + half]], stroke);
        }
        Outcome::Wrong => {
            let wave = [[-1.0, 0.2], [-0.5, -0.5], [0.5, 0.5], [1.0, -0.2]];
            sheet.line(&wave.map(|[dx, dy]| [x + dx * half, y + dy * half]), stroke);
        }
        Outcome::Diverged => hatch::cross(sheet, [x, y], 0.8 * half, stroke),
        Outcome::Indefinite => sheet.line(&across, stroke),
        Outcome::Refused => sheet.words("r", [x, y + 3.0], Anchor::Middle, ink),
        Outcome::Stable | Outcome::NotKnown => {}
    }
}
