//! The gallery: scenes by methods, verdicts by colour and by letter.

use nappe_study::{
    Verdict,
    gallery::{Exhibit, Family, Table},
};

use crate::{
    axes::Legend,
    canvas::{Anchor, width},
    look::INK,
    picture::Picture,
    sheet::Sheet,
    style::Style,
    words::{listed, reader},
};

/// Width and height of a cell (px).
const CELL: [f64; 2] = [26.0, 17.0];
/// Around the cells (px).
const MARGIN: f64 = 24.0;
/// Where the first panel begins (px).
const TOP: f64 = 84.0;
/// Between panels of cells (px), across and down.
const GAP: [f64; 2] = [14.0, 8.0];

/// Verdicts as legends list them: name, letter, fill, ink. In grey the fills differ too.
const LOOKS: [(&str, char, &str, &str); 6] = [
    ("survived", 'S', "#DDF0E6", "black"),
    ("recovered in shorter steps", 'R', "#7FB8DA", "black"),
    ("detected: ended with a reason", 'D', "#D98A1C", "black"),
    ("wrong", 'X', "#8A5FA8", "white"),
    ("warned of before the first step", 'W', "#F4E37A", "black"),
    ("lost without a word", 'L', "#7A1010", "white"),
];

/// The gallery: scenes by methods, verdicts by colour and letter. It has no room for a width below 160 mm: words are small there.
///
/// # Errors
/// What the plotter cannot make pixels of.
pub fn picture(tables: &[Table], style: &Style) -> Result<Picture, String> {
    let all = |families: &'static [Family]| {
        tables.iter().filter(move |table| families.contains(&table.family)).collect::<Vec<_>>()
    };
    let rows = [all(&[Family::Explicit, Family::Implicit]), all(&[Family::Squeezed]), all(&[Family::Snow])];
    let labels = longest(tables.iter().flat_map(|table| &table.scenes).map(label)) + 10.0;
    // Squeezed sheets stand below their methods, which the panel above names.
    let indent = GAP[0] + CELL[0] * count(tables, Family::Explicit) as f64;
    let left = MARGIN + labels;
    let columns = count(tables, Family::Explicit) + count(tables, Family::Implicit);
    let right = left + columns as f64 * CELL[0] + GAP[0];
    let title = style.title_or("Scenes in which programs of this kind fail".to_owned());
    let mut sheet = Sheet::new([right + MARGIN, 0.0]);
    let lower = sheet.title(&title);
    let mut legend = Legend::new([MARGIN, right], 52.0 + lower);
    for look in LOOKS {
        let [left, right, above, below] = legend.entry(&mut sheet, look.0);
        draw(&mut sheet, [left, right, above - 2.0, below + 2.0], look);
    }
    let mut y = TOP + lower;
    for row in &rows {
        y += head(row);
        let mut x = if row.iter().all(|table| is_named(table)) { left } else { left + indent };
        for (i, table) in row.iter().enumerate() {
            if i == 0 {
                write_scenes(&mut sheet, &table.scenes, [left - 8.0, y]);
            }
            if is_named(table) {
                write_methods(&mut sheet, table, [x, y]);
            }
            draw_cells(&mut sheet, table, [x, y]);
            x += table.methods.len() as f64 * CELL[0] + GAP[0];
        }
        y += cells(row) + GAP[1];
    }
    sheet.end_at(y);
    sheet.finish("gallery", &title, sentence(tables), style)
}

/// The methods of a family.
fn count(tables: &[Table], family: Family) -> usize {
    tables.iter().find(|table| table.family == family).map_or(0, |table| table.methods.len())
}

/// Whether the names of its methods stand above it.
fn is_named(table: &Table) -> bool {
    table.family != Family::Squeezed
}

/// How high the names of methods above a row of panels are (px).
fn head(row: &[&Table]) -> f64 {
    let names =
        row.iter().filter(|table| is_named(table)).flat_map(|table| &table.methods).map(|name| reader(name));
    longest(names) + 6.0
}

/// How high the cells of a row of panels are (px).
fn cells(row: &[&Table]) -> f64 {
    row.first().map_or(0.0, |table| table.scenes.len() as f64 * CELL[1])
}

fn label(exhibit: &Exhibit) -> String {
    format!("{}. {}", exhibit.number, exhibit.what)
}

/// How wide the longest of words is (px).
fn longest(words: impl Iterator<Item = String>) -> f64 {
    words.map(|word| width(&word)).fold(0.0, f64::max)
}

fn write_scenes(sheet: &mut Sheet, scenes: &[Exhibit], [right, above]: [f64; 2]) {
    for (i, exhibit) in scenes.iter().enumerate() {
        let y = above + (i as f64 + 0.5) * CELL[1] + 4.0;
        sheet.words(&label(exhibit), [right, y], Anchor::End, INK);
    }
}

fn write_methods(sheet: &mut Sheet, table: &Table, [left, below]: [f64; 2]) {
    for (i, method) in table.methods.iter().enumerate() {
        sheet.words_upwards(&reader(method), [left + (i as f64 + 0.5) * CELL[0] + 4.0, below - 6.0]);
    }
}

fn draw_cells(sheet: &mut Sheet, table: &Table, [left, above]: [f64; 2]) {
    for (row, exhibit) in table.scenes.iter().enumerate() {
        for (column, finding) in exhibit.findings.iter().enumerate() {
            let corner = [left + column as f64 * CELL[0], above + row as f64 * CELL[1]];
            let room =
                [corner[0] + 0.5, corner[0] + CELL[0] - 0.5, corner[1] + 0.5, corner[1] + CELL[1] - 0.5];
            if let Some(look) = LOOKS.into_iter().find(|look| look.1 == finding.letter()) {
                draw(sheet, room, look);
            }
        }
    }
}

/// A cell (left, right, above, below) with its letter.
fn draw(sheet: &mut Sheet, room: [f64; 4], (_, letter, fill, ink): (&str, char, &str, &str)) {
    let [left, right, above, below] = room;
    sheet.rectangle(room, fill);
    let middle = [f64::midpoint(left, right), f64::midpoint(above, below) + 4.0];
    sheet.words(&letter.to_string(), middle, Anchor::Middle, ink);
}

fn sentence(tables: &[Table]) -> String {
    let findings = || tables.iter().flat_map(|table| &table.scenes).flat_map(|exhibit| &exhibit.findings);
    let count = |verdict: Verdict| findings().filter(|finding| finding.verdict == verdict).count();
    let all = findings().count() - count(Verdict::None);
    let counts = [
        format!("{} survive", count(Verdict::Survived)),
        format!("{} recover in shorter steps", count(Verdict::Recovered)),
        format!("{} end with a reason", count(Verdict::Detected)),
        format!("{} end without one and are wrong", count(Verdict::Wrong)),
        format!("{} are warned of before their first step", count(Verdict::Warned)),
    ];
    let lost = match count(Verdict::Lost) {
        0 => "none loses its way without a word".to_owned(),
        1 => "1 loses its way without a word, which is an error of this program".to_owned(),
        more => format!("{more} lose their way without a word, which is an error of this program"),
    };
    format!(
        "Of {all} runs {}; {lost}. Each is of one method in one scene, as a scene runs it.",
        listed(&counts)
    )
}
