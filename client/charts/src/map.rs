//! Maps of stability: cells of steps against damping, or against how far the start is pressed together.

use nappe_study::{Across, Map, Stability, StabilityRow, Verdict, WRONG};

use crate::{
    axes::{self, LEGEND_LINE, Legend},
    canvas::{Anchor, Stroke, width},
    look::INK,
    panels::{self, Bands, Panel, has, spacing, step, value},
    picture::Picture,
    scale::{Scale, Spacing, Tick},
    sheet::Sheet,
    style::Style,
    verdicts::{self, GROWTH},
    words::{length, listed, number, time, within},
};

/// At the left, below the data, and at the right (px).
const LEFT: f64 = 78.0;
const BELOW: f64 = 50.0;
const RIGHT: f64 = 30.0;
/// From the first line of the legend to the data at least, and from its last one (px).
const ABOVE: f64 = 80.0;
const UNDER: f64 = 40.0;
/// Height of the data, at most, and least width of a panel (px).
const HEIGHT: f64 = 380.0;
const LEAST: f64 = 250.0;
/// Between panels (px), across and down; down there is the name of the next one.
const GAP: f64 = 28.0;
const DOWN: f64 = 24.0;
/// Where the legend begins (px).
const LEGEND: f64 = 58.0;
/// Places along a line of theory.
const SAMPLES: u32 = 400;

/// Scales of a panel.
#[derive(Clone, Copy, Debug)]
struct Scales {
    x: Scale,
    y: Scale,
}

/// Where panels stand (px).
#[derive(Clone, Copy, Debug)]
struct Places {
    page: f64,
    /// How many stand side by side.
    columns: usize,
    width: f64,
    height: f64,
}

impl Places {
    /// Those of so many panels: all side by side, unless a width is asked for in which there is no room for them.
    fn of(panels: usize, style: &Style) -> Self {
        let count = panels.max(1);
        let Some(page) = style.pixels() else {
            let width = match panels {
                0 | 1 => 640.0,
                2 => 400.0,
                3 => 300.0,
                _ => 260.0,
            };
            let page = LEFT + count as f64 * (width + GAP) - GAP + RIGHT;
            return Self { page, columns: count, width, height: HEIGHT };
        };
        let room = page - LEFT - RIGHT + GAP;
        let columns = ((room / (LEAST + GAP)).floor() as usize).clamp(1, count);
        let width = room / columns as f64 - GAP;
        Self { page, columns, width, height: width.min(HEIGHT) }
    }

    /// Where the data of a panel lie (left, right, above, below), the first of which begins at a height.
    fn data(&self, panel: usize, above: f64) -> [f64; 4] {
        let left = LEFT + (panel % self.columns) as f64 * (self.width + GAP);
        let above = above + (panel / self.columns) as f64 * (self.height + BELOW + DOWN);
        [left, left + self.width, above, above + self.height]
    }
}

/// What a map shows, for a study that has cells of it.
pub(crate) fn picture(
    scene: &str,
    stability: &Stability,
    map: Map,
    style: &Style,
) -> Result<Picture, String> {
    let panels = panels::of(stability, map);
    let rows: Vec<&StabilityRow> = panels.iter().flat_map(|panel| &panel.rows).copied().collect();
    let values = Bands::of(rows.iter().map(|row| value(row)), spacing(map));
    let places = Places::of(panels.len(), style);
    let (name, title) = match map {
        Map::Damping => ("map_damping", format!("{scene}: what steps are stable with what damping")),
        Map::Compression => {
            ("map_compression", format!("{scene}: what steps are stable from a start pressed together"))
        }
    };
    let title = style.title_or(title);
    let mut sheet = Sheet::new([places.page, 0.0]);
    let legend = LEGEND + sheet.title(&title);
    let scales = |panel: &Panel<'_>, [left, right, above, below]: [f64; 4]| Scales {
        x: Scale { spacing: Spacing::Log, ends: panel.steps.ends(), places: [left, right] },
        y: Scale { spacing: spacing(map), ends: values.ends(), places: [below, above] },
    };
    // Whether theory has a line hangs on no height.
    let has_border =
        |panel: &Panel<'_>| !border(stability, panel, &values, scales(panel, places.data(0, 0.0))).is_empty();
    let border_of_theory = if panels.iter().any(has_border) { Border::Drawn } else { Border::Unknown };
    let end = draw_legend(&mut sheet, &rows, border_of_theory, legend);
    let first = (legend + ABOVE).max(end + UNDER);
    let label = rows.first().map_or("", |row| label(row));
    let mut bottom = first;
    for (i, panel) in panels.iter().enumerate() {
        let room = places.data(i, first);
        let column = i % places.columns;
        draw_cells(&mut sheet, panel, &values, scales(panel, room));
        draw_border(&mut sheet, &border(stability, panel, &values, scales(panel, room)));
        draw_frame(&mut sheet, panel, &values, (scales(panel, room), room), column);
        let [_, _, above, below] = room;
        if column == 0 {
            sheet.label_upwards(label, [20.0, f64::midpoint(above, below)]);
        }
        bottom = below;
    }
    sheet.end_at(bottom + BELOW);
    let sentence = sentence(stability, map, &panels, border_of_theory);
    sheet.finish(name, &title, sentence, style)
}

/// The name of a panel, its frame (left, right, above, below) and its axes.
fn draw_frame(
    sheet: &mut Sheet,
    panel: &Panel<'_>,
    values: &Bands,
    (scales, room): (Scales, [f64; 4]),
    column: usize,
) {
    let [left, right, above, below] = room;
    let name = panel.method.reader_name();
    sheet.words(&name, [f64::midpoint(left, right), above - 9.0], Anchor::Middle, INK);
    sheet.outline(room, "black");
    axes::below(sheet, scales.x.ticks(), scales.x.places, below, "step (ms)");
    axes::left(sheet, marks(values, &scales.y, column), left);
}

/// What an axis says of what is varied.
fn label(row: &StabilityRow) -> &'static str {
    match row.across {
        Some((Across::Damping, _)) => "damping, times that of the scene",
        Some((Across::DampingRatio, _)) => "damping ratio of the fastest mode",
        Some((Across::Compression, _)) => "pressed together at the start (%)",
        None => "",
    }
}

/// Ticks of what is varied; numbers at the first column alone.
fn marks(values: &Bands, y: &Scale, column: usize) -> Vec<Tick> {
    let [low, high] = values.others();
    let mut ticks = Vec::new();
    if low < high {
        let others = Scale { ends: [low, high], places: [y.place(low), y.place(high)], ..*y };
        ticks = others.ticks();
    }
    if let Some([low, high]) = values.apart() {
        ticks.push(Tick { place: y.place(f64::midpoint(low, high)), number: Some("0".to_owned()) });
    }
    if column > 0 {
        for tick in &mut ticks {
            tick.number = None;
        }
    }
    ticks
}

fn draw_cells(sheet: &mut Sheet, panel: &Panel<'_>, values: &Bands, scales: Scales) {
    // Edges between pixels, so that nothing shows between neighbours.
    let whole = |place: f64| (2.0 * place).round() / 2.0;
    for row in &panel.rows {
        let bands = (panel.steps.band(step(row)), values.band(value(row)));
        let (Some(x), Some(y)) = bands else { continue };
        let [left, right] = x.map(|edge| whole(scales.x.place(edge)));
        let [below, above] = y.map(|edge| whole(scales.y.place(edge)));
        verdicts::draw(sheet, [left, right, above, below], row.verdict, row.growth);
    }
    if let Some([_, edge]) = values.apart() {
        let y = whole(scales.y.place(edge));
        let line = scales.x.places.map(|x| [x, y]);
        sheet.line(&line, Stroke { colour: "white", width: 2.0, dashes: "" });
    }
}

/// Where theory sets the limit of an explicit method, as lines (px); it says nothing of ratios and of compression.
fn border(stability: &Stability, panel: &Panel<'_>, values: &Bands, scales: Scales) -> Vec<Vec<[f64; 2]>> {
    let integrator = panel.method.integrator;
    let is_factor = panel.rows.iter().all(|row| matches!(row.across, Some((Across::Damping, _))));
    let theory = stability.theory.as_ref().filter(|_| is_factor && !integrator.is_implicit());
    let Some(theory) = theory else { return Vec::new() };
    let mut samples: Vec<(f64, f64)> = Vec::new();
    if let Some(ends) = values.apart() {
        samples.extend(ends.map(|edge| (0.0, edge)));
    }
    let [low, high] = values.others();
    if low < high {
        let at = |i: u32| low + (high - low) * f64::from(i) / f64::from(SAMPLES);
        samples.extend((0..=SAMPLES).map(at).map(|coordinate| (10_f64.powf(coordinate), coordinate)));
    }
    let mut lines = Vec::new();
    let mut line = Vec::new();
    for (factor, coordinate) in samples {
        let limit = theory.limit_with(integrator, factor).map(|limit| limit * 1e3);
        match limit.filter(|limit| scales.x.holds(*limit)) {
            Some(limit) => line.push([scales.x.at(limit), scales.y.place(coordinate)]),
            None => lines.push(std::mem::take(&mut line)),
        }
    }
    lines.push(line);
    lines.retain(|line| line.len() > 1);
    lines
}

/// Draws lines, white on black; says whether there are any.
fn draw_border(sheet: &mut Sheet, lines: &[Vec<[f64; 2]>]) -> bool {
    for (colour, width) in [("black", 4.5), ("white", 2.0)] {
        for line in lines {
            sheet.line(line, Stroke { colour, width, dashes: "" });
        }
    }
    !lines.is_empty()
}

/// Whether theory has a limit that is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Border {
    Drawn,
    Unknown,
}

/// What colours and signs mean, of those that are drawn, from a height (px) on; the height of its last line.
fn draw_legend(sheet: &mut Sheet, rows: &[&StabilityRow], border: Border, above: f64) -> f64 {
    let mut legend = Legend::new([24.0, sheet.width() - 10.0], above);
    for verdict in verdicts::ALL {
        if rows.iter().any(|row| row.verdict == verdict) {
            let room = legend.entry(sheet, &verdict.name().replace('_', " "));
            verdicts::draw(sheet, room, verdict, Some(verdicts::example(verdict)));
            sheet.outline(room, INK);
        }
    }
    if border == Border::Drawn {
        let [left, right, above, below] = legend.entry(sheet, "theory at rest");
        let y = f64::midpoint(above, below);
        draw_border(sheet, &[vec![[left, y], [right, y]]]);
    }
    draw_colours(sheet, [24.0, legend.end() + LEGEND_LINE])
}

/// The colours of growth from a place (px) on, with the growth at both ends, in one line or two; the height of the last one.
fn draw_colours(sheet: &mut Sheet, [left, y]: [f64; 2]) -> f64 {
    let [least, greatest] = GROWTH.map(|decades| number(10_f64.powf(decades)));
    let what = "rise of the energy, as a share of the largest:";
    let [before, after] = [format!("{least} or less"), format!("{greatest} or more")];
    let room = width(what) + width(&before) + verdicts::COLOURS + width(&after) + 20.0;
    let (before, y) = if left + room > sheet.width() {
        sheet.words(what, [left, y], Anchor::Start, INK);
        (before, y + LEGEND_LINE)
    } else {
        (format!("{what} {before}"), y)
    };
    sheet.words(&before, [left, y], Anchor::Start, INK);
    let from = left + width(&before) + 8.0;
    verdicts::draw_colours(sheet, [from, y]);
    sheet.words(&after, [from + verdicts::COLOURS + 8.0, y], Anchor::Start, INK);
    y
}

fn sentence(stability: &Stability, map: Map, panels: &[Panel<'_>], border: Border) -> String {
    let cells = || stability.rows.iter().filter(|row| has(map, row));
    let count = |is_one: fn(Verdict) -> bool| cells().filter(|row| is_one(row.verdict)).count();
    let be = |count: usize| if count == 1 { "is" } else { "are" };
    let stable = count(|verdict| verdict == Verdict::Stable);
    let wrong = count(|verdict| verdict == Verdict::Wrong);
    let failed = count(Verdict::is_failure);
    let unknown = count(verdicts::is_unknown);
    let mut counts = vec![format!("{stable} {} stable", be(stable))];
    if wrong > 0 {
        let off = length(WRONG * stability.tolerance);
        counts.push(format!("{wrong} {} stable but more than {off} off", be(wrong)));
    }
    counts.push(match failed {
        0 => "none fails".to_owned(),
        1 => "1 fails".to_owned(),
        more => format!("{more} fail"),
    });
    if unknown > 0 {
        let cut = cells().find_map(|row| row.cut);
        let why = cut.map_or_else(String::new, |cut| format!(", {}", cut.why()));
        counts.push(format!("{unknown} {} not known{why}", be(unknown)));
    }
    let theory = match border {
        Border::Drawn => " The white line is the limit that theory sets at rest.",
        Border::Unknown => "",
    };
    format!("Of {} cells {}{}.{theory}", cells().count(), listed(&counts), failures(panels))
}

/// The shortest step that fails with each method, as clauses that follow others.
fn failures(panels: &[Panel<'_>]) -> String {
    let mut first = Vec::new();
    let mut never = Vec::new();
    for panel in panels {
        let name = within(&panel.method.reader_name());
        match panel.first_failure() {
            Some(row) => {
                let (what, unit) = match row.across {
                    Some((Across::Damping, _)) => ("damping factor", ""),
                    Some((Across::DampingRatio, _)) => ("damping ratio", ""),
                    Some((Across::Compression, _)) | None => ("pressed together by", " %"),
                };
                let value = number(value(row));
                first.push(format!("{} with {name} ({what} {value}{unit})", time(row.dt)));
            }
            None if panel.rows.iter().all(|row| row.cut.is_some()) => {}
            None => never.push(name),
        }
    }
    let is_cut = panels.iter().flat_map(|panel| &panel.rows).any(|row| row.cut.is_some());
    let [fails, of_cells] = if is_cut { ["is known to fail", " that is known"] } else { ["fails", ""] };
    let mut clauses = vec![String::new()];
    if !first.is_empty() {
        clauses.push(format!("the shortest step that {fails} is {}", listed(&first)));
    }
    if !never.is_empty() {
        let verb = if never.len() == 1 { "fails" } else { "fail" };
        clauses.push(format!("{} {verb} in no cell{of_cells}", listed(&never)));
    }
    clauses.join("; ")
}
