//! What a scene can do without: how far the answer moves without each of its terms, a row each, and the time that is saved.

use nappe_study::{Plan, Term};

use crate::{
    axes::{self, LEGEND_LINE, Legend},
    canvas::{Anchor, Stroke, width},
    hatch,
    lines::around,
    look::INK,
    picture::Picture,
    scale::{Scale, Spacing},
    sheet::{Names, Sheet},
    style::Style,
    words::{length, listed},
};

/// Colours of what can go and of what is needed.
const GONE: &str = "#009E73";
const NEEDED: &str = "#D55E00";
/// What leads from a name to its mark.
const GUIDE: &str = "#C4C4C4";
/// Width of the picture (px).
const WIDTH: f64 = 860.0;
/// At the right of the data (px), where it is written what is saved.
const RIGHT: f64 = 104.0;
/// Where the legend begins (px).
const LEGEND: f64 = 58.0;
/// Least width of the data (px) beside which names stand; below it they stand above the marks, so far from the edges.
const BESIDE: f64 = 300.0;
const EDGE: f64 = 24.0;
/// Height of a term, and of its name where that stands above its mark (px).
const ROW: f64 = 24.0;
const NAME: f64 = 14.0;
/// Below the data (px).
const BELOW: f64 = 50.0;
/// Half the side of a mark (px).
const MARK: f64 = 5.0;
/// Share of the tolerance up to which changes stand at the left end.
const LEAST: f64 = 1e-6;
/// The least share of the time that is no noise.
const LEAST_SAVING: f64 = 0.05;

/// What is known of a term.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Gone,
    Small,
    Needed,
    Failed,
    Unknown,
}

impl Kind {
    const ALL: [Self; 5] = [Self::Gone, Self::Small, Self::Needed, Self::Failed, Self::Unknown];

    const fn of(term: &Term) -> Self {
        match (term.change, &term.failure) {
            (None, Some(_)) => Self::Failed,
            (None, None) => Self::Unknown,
            (Some(_), _) if term.is_left_out => Self::Gone,
            (Some(_), _) if term.is_needed => Self::Needed,
            (Some(_), _) => Self::Small,
        }
    }

    const fn words(self) -> &'static str {
        match self {
            Self::Gone => "can go",
            Self::Small => "small alone, and not together",
            Self::Needed => "needed",
            Self::Failed => "fails without it",
            Self::Unknown => "not known",
        }
    }

    /// Draws its mark about a place (px): shapes tell them apart without colour.
    fn draw(self, sheet: &mut Sheet, [x, y]: [f64; 2]) {
        let room = [x - MARK, x + MARK, y - MARK, y + MARK];
        match self {
            Self::Gone => sheet.diamond([x, y], MARK + 1.5, GONE),
            Self::Small => {
                sheet.rectangle(room, "white");
                sheet.outline(room, INK);
            }
            Self::Needed => sheet.rectangle(room, NEEDED),
            Self::Failed => {
                hatch::cross(sheet, [x, y], MARK, Stroke { colour: INK, width: 1.6, dashes: "" });
            }
            Self::Unknown => {}
        }
    }
}

/// What the terms of a plan are to its answer.
pub(crate) fn picture(scene: &str, plan: &Plan, style: &Style) -> Result<Picture, String> {
    let title = style.title_or(format!("{scene}: what it can do without"));
    drawn((title.as_str(), sentence(plan)), &plan.terms, plan.chart.tolerance, style)
}

/// Terms in rows, below a title and above a sentence, for an error that matters (m).
fn drawn(
    (title, sentence): (&str, String),
    terms: &[Term],
    tolerance: f64,
    style: &Style,
) -> Result<Picture, String> {
    let page = style.pixels().unwrap_or(WIDTH);
    let beside = terms.iter().map(|term| width(&term.name)).fold(80.0, f64::max) + 26.0;
    let (names, places, row) = if page - RIGHT - beside < BESIDE {
        (Names::Above, [EDGE, page - EDGE], ROW + NAME)
    } else {
        (Names::Beside, [beside, page - RIGHT], ROW)
    };
    let mut sheet = Sheet::new([page, 0.0]);
    let legend = LEGEND + sheet.title(title);
    let above = draw_legend(&mut sheet, terms, tolerance, legend).max(legend + LEGEND_LINE) + 18.0;
    let below = above + row * terms.len() as f64;
    sheet.end_at(below + BELOW);

    let scale = Scale { spacing: Spacing::Log, ends: ends(terms, tolerance), places };
    let [left, right] = places;
    axes::grid(&mut sheet, &scale, [above, below]);
    draw_tolerance(&mut sheet, scale.at(tolerance * 1e3), [above, below]);
    for (i, term) in terms.iter().enumerate() {
        let y = above + row * (i as f64 + 1.0) - 0.5 * ROW;
        draw_term(&mut sheet, term, &scale, y);
        let saved = saved(term);
        let is_alone = names == Names::Beside || saved.is_empty();
        let told = if is_alone { saved } else { format!("time saved: {saved}") };
        sheet.names(names, [&term.name, &told], places, [y, y - MARK - 4.0]);
    }
    sheet.outline([left, right, above, below], "black");
    axes::below(&mut sheet, scale.ticks(), places, below, "the answer moves by (mm)");
    if names == Names::Beside {
        sheet.words("time saved", [right + 10.0, above - 8.0], Anchor::Start, INK);
    }
    sheet.finish("terms", title, sentence, style)
}

/// Both ends of the axis, as coordinates of millimetres: around the tolerance (m) and all changes that are not next to nothing.
fn ends(terms: &[Term], tolerance: f64) -> [f64; 2] {
    let tolerance = tolerance * 1e3;
    let changes = terms.iter().filter_map(|term| term.change).map(|change| change * 1e3);
    let seen = changes.map(|change| change.max(LEAST * tolerance));
    around(seen.chain([tolerance])).map(|end| Spacing::Log.coordinate(end))
}

fn draw_tolerance(sheet: &mut Sheet, x: f64, [above, below]: [f64; 2]) {
    sheet.line(&[[x, above], [x, below]], Stroke { colour: INK, width: 1.0, dashes: "4 4" });
}

/// What marks mean, of those that are drawn, from a height (px) on; the height of its last line.
fn draw_legend(sheet: &mut Sheet, terms: &[Term], tolerance: f64, above: f64) -> f64 {
    let mut legend = Legend::new([EDGE, sheet.width() - 10.0], above);
    // Of a term that is not known the words stand in its row.
    let drawn = Kind::ALL.into_iter().filter(|kind| *kind != Kind::Unknown);
    for kind in drawn.filter(|kind| terms.iter().any(|term| Kind::of(term) == *kind)) {
        let [left, right, above, below] = legend.entry(sheet, kind.words());
        kind.draw(sheet, [f64::midpoint(left, right), f64::midpoint(above, below)]);
    }
    let told = format!("tolerance, {}", length(tolerance));
    let [left, right, above, below] = legend.entry(sheet, &told);
    draw_tolerance(sheet, f64::midpoint(left, right), [above - 2.0, below + 2.0]);
    legend.end()
}

/// Draws a term in its row, whose middle is at a height (px): a mark where the answer moves to, or words where that is not known.
fn draw_term(sheet: &mut Sheet, term: &Term, scale: &Scale, y: f64) {
    let [left, _] = scale.places;
    let kind = Kind::of(term);
    let Some(change) = term.change else {
        kind.draw(sheet, [left + 3.0 * MARK, y]);
        return sheet.words(kind.words(), [left + 6.0 * MARK, y + 4.0], Anchor::Start, INK);
    };
    let x = scale.at(change * 1e3);
    sheet.line(&[[left, y], [x, y]], Stroke { colour: GUIDE, width: 1.2, dashes: "1 3" });
    kind.draw(sheet, [x, y]);
}

/// The share of the time that is saved, to the percent, where it is no noise; nothing where it is not known.
fn saved(term: &Term) -> String {
    term.saving.map_or_else(String::new, |saving| {
        if saving < LEAST_SAVING { "none".to_owned() } else { format!("{:.0} %", 100.0 * saving) }
    })
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
        "{answer} Answers are compared {}. Hollow diamonds can go, filled squares are needed, hollow squares are small alone, and not together.",
        plan.chart.compared()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// So many terms of every kind, in turn.
    fn terms(count: usize) -> Vec<Term> {
        let of = |place: usize| Term {
            name: format!("friction of thing {place}"),
            place,
            change: (place % 5 < 3).then(|| [0.0, 2e-5, 0.3][place % 5]),
            failure: (place % 5 == 3).then(|| "its energy rose".to_owned()),
            saved_counts: None,
            saving: [Some(0.12), Some(-0.03), None][place % 3],
            is_looked_at: place % 5 < 4,
            is_needed: place % 5 >= 2,
            is_left_out: place.is_multiple_of(5),
        };
        (0..count).map(of).collect()
    }

    fn height(count: usize, millimetres: Option<f64>) -> f64 {
        let style = Style { width: millimetres, is_without_caption: true, ..Style::default() };
        let made = drawn(("t", String::new()), &terms(count), 1e-3, &style).expect("a picture");
        let (head, _) = made.svg.split_once('>').expect("a tag");
        let (_, rest) = head.split_once(" height=\"").expect("its height");
        let number = rest.split_once('"').expect("its end").0.trim_end_matches("mm");
        number.parse().expect("a number")
    }

    #[test]
    fn a_picture_is_as_high_as_its_rows() {
        assert!((height(12, None) - height(5, None) - 7.0 * ROW).abs() < 1.0);
        assert!(height(1, None) < 250.0, "{} px", height(1, None));
        assert!(height(12, Some(85.0)) > height(5, Some(85.0)));
    }

    #[test]
    fn every_term_has_a_name_and_a_mark_or_words() {
        let made =
            drawn(("title", "sentence".to_owned()), &terms(5), 1e-3, &Style::default()).expect("a picture");
        for words in ["friction of thing 0", "friction of thing 4", "fails without it", "not known", "12 %"] {
            assert!(made.svg.contains(words), "{words}");
        }
        for words in ["can go", "needed", "small alone", "tolerance, 1 mm", "time saved"] {
            assert!(made.svg.contains(words), "{words}");
        }
        assert!(!made.svg.contains("NaN"), "every mark has a place");
        let kinds: Vec<Kind> = terms(5).iter().map(Kind::of).collect();
        assert_eq!(kinds, Kind::ALL);
    }
}
