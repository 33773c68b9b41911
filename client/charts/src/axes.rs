//! Axes and legends of pictures that draw their own.

use crate::{
    canvas::{Anchor, Stroke, width},
    look::INK,
    scale::{Scale, Tick},
    sheet::Sheet,
};

/// Lines behind the data.
const GRID: &str = "#DDDDDD";
/// Width of a sample in a legend (px).
const SAMPLE: f64 = 22.0;
/// Between the lines of a legend (px).
pub(crate) const LEGEND_LINE: f64 = 20.0;

/// Lines behind the data at ticks with numbers, from above to below (px).
pub(crate) fn grid(sheet: &mut Sheet, scale: &Scale, [above, below]: [f64; 2]) {
    for tick in scale.ticks().iter().filter(|tick| tick.number.is_some()) {
        let line = [[tick.place, above], [tick.place, below]];
        sheet.line(&line, Stroke { colour: GRID, width: 1.0, dashes: "" });
    }
}

/// Ticks and numbers below the data, at a height (px), and what they are.
pub(crate) fn below(sheet: &mut Sheet, scale: &Scale, y: f64, label: &str) {
    // Numbers that would touch are left out.
    let mut free = f64::NEG_INFINITY;
    for Tick { place, number } in scale.ticks() {
        let length = if number.is_some() { 5.0 } else { 3.0 };
        sheet.line(&[[place, y], [place, y + length]], Stroke { colour: "black", width: 1.0, dashes: "" });
        if let Some(number) = number {
            let half = 0.5 * width(&number);
            if place - half > free {
                sheet.words(&number, [place, y + 18.0], Anchor::Middle, "black");
                free = place + half + 4.0;
            }
        }
    }
    sheet.label(label, [f64::midpoint(scale.places[0], scale.places[1]), y + 38.0]);
}

/// Ticks at the left of the data, at a place (px).
pub(crate) fn left(sheet: &mut Sheet, ticks: &[Tick], x: f64) {
    for Tick { place, number } in ticks {
        let length = if number.is_some() { 5.0 } else { 3.0 };
        sheet.line(&[[x - length, *place], [x, *place]], Stroke { colour: "black", width: 1.0, dashes: "" });
        if let Some(number) = number {
            sheet.words(number, [x - 8.0, *place + 4.0], Anchor::End, "black");
        }
    }
}

/// A legend, written from left to right, in as many lines as it takes.
pub(crate) struct Legend {
    left: f64,
    right: f64,
    x: f64,
    y: f64,
}

impl Legend {
    /// Between two places, its first line at a height (px).
    pub(crate) const fn new([left, right]: [f64; 2], y: f64) -> Self {
        Self { left, right, x: left, y }
    }

    /// Writes what a sample means, and says where the sample belongs: left, right, above, below (px).
    pub(crate) fn entry(&mut self, sheet: &mut Sheet, text: &str) -> [f64; 4] {
        let room = SAMPLE + 6.0 + width(text);
        if self.x > self.left && self.x + room > self.right {
            (self.x, self.y) = (self.left, self.y + LEGEND_LINE);
        }
        let sample = [self.x, self.x + SAMPLE, self.y - 10.0, self.y + 2.0];
        sheet.words(text, [self.x + SAMPLE + 6.0, self.y], Anchor::Start, INK);
        self.x += room + 18.0;
        sample
    }

    /// How high the last line is (px).
    pub(crate) const fn end(&self) -> f64 {
        self.y
    }
}
