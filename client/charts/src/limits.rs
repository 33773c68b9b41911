//! The longest steps of each method: what is stable, what is wrong, what fails, and what was expected.

use nappe_study::{NoReference, Over, Stability, WRONG};

use crate::{
    axes::{self, LEGEND_LINE, Legend},
    bars::{self, Bar, Bears, Kind},
    canvas::{Anchor, Stroke, width},
    hatch,
    look::INK,
    picture::Picture,
    scale::{Scale, Spacing},
    sheet::{Names, Sheet},
    style::Style,
    words::{length, listed, number, time, within},
};

/// Width of the picture (px).
const WIDTH: f64 = 980.0;
/// At the right of the data (px), where it is written what a method bears.
const RIGHT: f64 = 144.0;
/// Where the legend begins (px).
const LEGEND: f64 = 58.0;
/// Least width of the data (px) beside which names stand; below it they stand above the bars, so far from the edges.
const BESIDE: f64 = 300.0;
const EDGE: f64 = 24.0;
/// Height of a method, of its name where that stands above its bar, and of its bar (px).
const ROW: f64 = 32.0;
const NAME: f64 = 16.0;
const BAR: f64 = 13.0;
/// By how much ticks are longer than a bar (px).
const TICK: f64 = 6.0;
/// Below the data (px).
const BELOW: f64 = 50.0;
/// How far (share) the axis reaches below what is shown, and the least share of it that is shown.
const SPARE: f64 = 0.3;
const LEAST: f64 = 1e-7;
/// Methods that a sentence names, at most.
const NAMED: usize = 4;

/// What the limits are, for a study that tried steps.
pub(crate) fn picture(scene: &str, stability: &Stability, style: &Style) -> Result<Picture, String> {
    let over = bars::drawn(stability);
    let bars = bars::of(stability, over);
    let page = style.pixels().unwrap_or(WIDTH);
    let beside = bars.iter().map(|bar| width(&bar.name)).fold(100.0, f64::max) + 26.0;
    let (names, left, right, row) = if page - RIGHT - beside < BESIDE {
        (Names::Above, EDGE, page - EDGE, ROW + NAME)
    } else {
        (Names::Beside, beside, page - RIGHT, ROW)
    };
    let title = style.title_or(match over {
        Over::Rest => format!("{scene}: longest steps at rest"),
        Over::Load | Over::Scene => format!("{scene}: longest steps under load"),
    });
    let mut sheet = Sheet::new([page, 0.0]);
    let legend = LEGEND + sheet.title(&title);
    let end = draw_legend(&mut sheet, &bars, over, WRONG * stability.tolerance, legend);
    // Room for a legend of two lines at least.
    let above = end.max(legend + LEGEND_LINE) + 22.0;
    let below = above + row * bars.len() as f64;
    sheet.end_at(below + BELOW);
    let scale = Scale {
        spacing: Spacing::Log,
        ends: ends(&bars, bars::longest(stability, over)),
        places: [left, right],
    };
    axes::grid(&mut sheet, &scale, [above, below]);
    for (i, bar) in bars.iter().enumerate() {
        let y = above + row * (i as f64 + 1.0) - 0.5 * ROW;
        draw_parts(&mut sheet, bar, &scale, y);
        draw_marks(&mut sheet, bar, over, &scale, y);
        sheet.names(names, [&bar.name, &borne_by(bar)], [left, right], [y, y - 0.5 * BAR - TICK - 4.0]);
    }
    sheet.outline([left, right, above, below], "black");
    axes::below(&mut sheet, scale.ticks(), scale.places, below, "step (ms)");
    match names {
        Names::Beside => sheet.words("limit", [right + 10.0, above - 8.0], Anchor::Start, INK),
        Names::Above => sheet.words("limit", [right, above - 8.0], Anchor::End, INK),
    }
    sheet.finish("limits", &title, sentence(stability, &bars, over), style)
}

/// Both ends of the axis (ms): from below the shortest limit to the longest step that was tried.
fn ends(bars: &[Bar<'_>], longest: f64) -> [f64; 2] {
    let steps: Vec<f64> = bars.iter().flat_map(Bar::shown).collect();
    let high = steps.iter().copied().fold(longest, f64::max);
    let low = steps.into_iter().fold(0.1 * high, f64::min).max(LEAST * high);
    [SPARE * low, 1.05 * high].map(|step| Spacing::Log.coordinate(step * 1e3))
}

/// Fills a rectangle (left, right, above, below) as steps of a kind are drawn.
fn fill(sheet: &mut Sheet, room: [f64; 4], kind: Kind) {
    let stroke = |colour| Stroke { colour, width: 1.2, dashes: "" };
    match kind {
        Kind::Stable => sheet.rectangle(room, "#0072B2"),
        Kind::Wrong => {
            sheet.rectangle(room, "#F7CB80");
            hatch::lines(sheet, room, stroke("#7A4B00"));
        }
        Kind::Failed => {
            sheet.rectangle(room, "#EBEBEB");
            hatch::crosses(sheet, room, stroke("#8C8C8C"));
        }
        Kind::Unknown => sheet.rectangle(room, "#A6A6A6"),
    }
    sheet.outline(room, INK);
}

fn draw_parts(sheet: &mut Sheet, bar: &Bar<'_>, scale: &Scale, y: f64) {
    for part in &bar.parts {
        let [from, to] = [part.from, part.to].map(|step| scale.at(step * 1e3));
        if to > from {
            fill(sheet, [from, to, y - 0.5 * BAR, y + 0.5 * BAR], part.kind);
        }
    }
}

/// A mark on a bar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mark {
    Theory,
    Measured,
    Bound,
}

/// Draws a mark about a place: theory sticks out above the bar, the bound below it.
fn draw_mark(sheet: &mut Sheet, mark: Mark, [x, y]: [f64; 2]) {
    let half = 0.5 * BAR;
    let (ends, dark, dashes) = match mark {
        Mark::Theory => ([y - half - TICK, y + half], 3.0, ""),
        Mark::Bound => ([y - half, y + half + TICK + 1.0], 2.0, "4 2"),
        Mark::Measured => return sheet.diamond([x, y], 5.0, "black"),
    };
    let line = ends.map(|end| [x, end]);
    // White about it, so that it is seen on dark bars.
    sheet.line(&line, Stroke { colour: "white", width: dark + 2.0, dashes: "" });
    sheet.line(&line, Stroke { colour: "black", width: dark, dashes });
}

/// Draws what was expected of a method.
fn draw_marks(sheet: &mut Sheet, bar: &Bar<'_>, over: Over, scale: &Scale, y: f64) {
    // At rest the bar itself shows what was measured there.
    let measured = bar.measured().filter(|_| over == Over::Load);
    let marks = [(Mark::Bound, bar.bound()), (Mark::Theory, bar.theory()), (Mark::Measured, measured)];
    for (mark, step) in marks {
        if let Some(step) = step.filter(|step| scale.holds(step * 1e3)) {
            draw_mark(sheet, mark, [scale.at(step * 1e3), y]);
        }
    }
}

/// What a method bears, in a few words.
fn borne_by(bar: &Bar<'_>) -> String {
    match bar.bears() {
        Bears::UpTo(limit) => time(limit),
        Bears::Nothing => "no step holds".to_owned(),
        Bears::All(longest) => format!("none to {}", time(longest)),
        Bears::Unfinished => "not known".to_owned(),
    }
}

/// What colours and ticks mean, of those that are drawn, from a height (px) on; the height of its last line.
fn draw_legend(sheet: &mut Sheet, bars: &[Bar<'_>], over: Over, wrong: f64, above: f64) -> f64 {
    let mut legend = Legend::new([EDGE, sheet.width() - 10.0], above);
    let has = |kind: Kind| bars.iter().any(|bar| bar.parts.iter().any(|part| part.kind == kind));
    let kinds = [
        (Kind::Stable, "stable".to_owned()),
        (Kind::Wrong, format!("stable but wrong: more than {} off", length(wrong))),
        (Kind::Failed, "failed".to_owned()),
        (Kind::Unknown, "not known".to_owned()),
    ];
    for (kind, text) in kinds.iter().filter(|(kind, _)| has(*kind)) {
        let room = legend.entry(sheet, text);
        fill(sheet, room, *kind);
    }
    let marks = [
        (Mark::Theory, "theory at rest", bars.iter().any(|bar| bar.theory().is_some())),
        (
            Mark::Measured,
            "measured at rest",
            over == Over::Load && bars.iter().any(|bar| bar.measured().is_some()),
        ),
        (Mark::Bound, "certified bound", bars.iter().any(|bar| bar.bound().is_some())),
    ];
    for (mark, text, _) in marks.iter().filter(|(.., is_drawn)| *is_drawn) {
        let [left, right, above, below] = legend.entry(sheet, text);
        draw_mark(sheet, *mark, [f64::midpoint(left, right), f64::midpoint(above, below)]);
    }
    legend.end()
}

fn sentence(stability: &Stability, bars: &[Bar<'_>], over: Over) -> String {
    let mut clauses: Vec<String> =
        [borne(bars), unlimited(bars), others(bars)].into_iter().flatten().collect();
    let is_wrong = |bar: &Bar<'_>| bar.parts.iter().any(|part| part.kind == Kind::Wrong);
    if bars.iter().any(is_wrong) {
        let wrong = length(WRONG * stability.tolerance);
        clauses.push(format!("hatched steps are stable but more than {wrong} off"));
    }
    let missing = match &stability.missing {
        Some(NoReference::Failed(cause)) => {
            format!("Nothing could be judged under load: {}. ", cause.trim_end_matches('.'))
        }
        Some(NoReference::Time(_)) => "Nothing could be judged under load: out of time. ".to_owned(),
        None => String::new(),
    };
    match over {
        Over::Rest => format!("{missing}At rest {}.", clauses.join("; ")),
        Over::Load | Over::Scene => format!("Under load {}.", clauses.join("; ")),
    }
}

/// The longest limits, and how they compare with the bound.
fn borne(bars: &[Bar<'_>]) -> Option<String> {
    let mut limits: Vec<(f64, &Bar<'_>)> = Vec::new();
    for bar in bars {
        if let Bears::UpTo(limit) = bar.bears() {
            limits.push((limit, bar));
        }
    }
    limits.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut clauses: Vec<String> = Vec::new();
    for (i, (limit, bar)) in limits.iter().take(NAMED).enumerate() {
        let verb = if i == 0 { " bears" } else { "" };
        let ratio = bar.bound().map_or_else(String::new, |bound| {
            let of_what = if i == 0 { " times the certified bound" } else { " times" };
            format!(" ({}{of_what})", number(limit / bound))
        });
        clauses.push(format!("{}{verb} {}{ratio}", within(&bar.name), time(*limit)));
    }
    match limits.len().saturating_sub(NAMED) {
        0 => {}
        1 => clauses.push("1 more bears less".to_owned()),
        more => clauses.push(format!("{more} more bear less")),
    }
    (!clauses.is_empty()).then(|| listed(&clauses))
}

/// Methods that bear every step that was tried.
fn unlimited(bars: &[Bar<'_>]) -> Option<String> {
    let mut names = Vec::new();
    let mut least = f64::INFINITY;
    for bar in bars {
        if let Bears::All(longest) = bar.bears() {
            names.push(within(&bar.name));
            least = least.min(longest);
        }
    }
    let verb = if names.len() == 1 { "has" } else { "have" };
    (!names.is_empty()).then(|| format!("{} {verb} no limit up to {}", few(names), time(least)))
}

/// Methods that bear nothing, and those that were not finished.
fn others(bars: &[Bar<'_>]) -> Option<String> {
    let names_of = |bears: Bears| {
        let of_them = bars.iter().filter(|bar| bar.bears() == bears).map(|bar| within(&bar.name));
        of_them.collect::<Vec<_>>()
    };
    let mut clauses = Vec::new();
    let failed = names_of(Bears::Nothing);
    if !failed.is_empty() {
        let verb = if failed.len() == 1 { "bears" } else { "bear" };
        clauses.push(format!("{} {verb} no step that was tried", few(failed)));
    }
    let unfinished = names_of(Bears::Unfinished);
    if !unfinished.is_empty() {
        let verb = if unfinished.len() == 1 { "is" } else { "are" };
        clauses.push(format!("{} {verb} not known: {}", few(unfinished), why(bars)));
    }
    (!clauses.is_empty()).then(|| clauses.join("; "))
}

/// Why limits are not known.
fn why(bars: &[Bar<'_>]) -> String {
    let causes = bars.iter().filter(|bar| bar.bears() == Bears::Unfinished).filter_map(Bar::cause);
    let mut causes: Vec<String> = causes.collect();
    causes.dedup();
    listed(&causes)
}

/// Names one after another; of many, how many more there are.
fn few(mut names: Vec<String>) -> String {
    let more = names.len().saturating_sub(NAMED);
    if more > 1 {
        names.truncate(NAMED);
        names.push(format!("{more} more"));
    }
    listed(&names)
}
