//! Patterns that tell areas apart without colour.

use crate::{canvas::Stroke, sheet::Sheet};

/// Between the lines of a hatching (px).
const LINES: f64 = 6.0;
/// Between crosses (px), and half of the width of one.
const CROSSES: f64 = 12.0;
const ARM: f64 = 2.2;

/// Lines that rise to the right, in a rectangle (left, right, above, below).
pub(crate) fn lines(sheet: &mut Sheet, [left, right, above, below]: [f64; 4], stroke: Stroke<'_>) {
    let height = below - above;
    // At the same places in every rectangle, so that rectangles that touch go on.
    let mut start = ((left - height) / LINES).floor() * LINES;
    while start < right {
        let [from, to] = [start.max(left), (start + height).min(right)];
        if from < to {
            sheet.line(&[[from, below - (from - start)], [to, below - (to - start)]], stroke);
        }
        start += LINES;
    }
}

/// Crosses in a row through the middle of a rectangle (left, right, above, below).
pub(crate) fn crosses(sheet: &mut Sheet, [left, right, above, below]: [f64; 4], stroke: Stroke<'_>) {
    let y = f64::midpoint(above, below);
    let mut x = ((left + ARM + 1.0) / CROSSES).ceil() * CROSSES;
    while x <= right - ARM - 1.0 {
        cross(sheet, [x, y], ARM, stroke);
        x += CROSSES;
    }
}

/// A cross about a place (px).
pub(crate) fn cross(sheet: &mut Sheet, [x, y]: [f64; 2], arm: f64, stroke: Stroke<'_>) {
    sheet.line(&[[x - arm, y - arm], [x + arm, y + arm]], stroke);
    sheet.line(&[[x - arm, y + arm], [x + arm, y - arm]], stroke);
}
