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
/// Height of a number beside an axis (px), and what stays free between two (px).
const HEIGHT: f64 = 10.0;
const FREE: f64 = 4.0;
/// Between the lines of a legend (px).
pub(crate) const LEGEND_LINE: f64 = 20.0;

/// Lines behind the data at ticks with numbers, from above to below (px).
pub(crate) fn grid(sheet: &mut Sheet, scale: &Scale, [above, below]: [f64; 2]) {
    for tick in scale.ticks().iter().filter(|tick| tick.number.is_some()) {
        let line = [[tick.place, above], [tick.place, below]];
        sheet.line(&line, Stroke { colour: GRID, width: 1.0, dashes: "" });
    }
}

/// Ticks and numbers below the data, at a height (px), and what they are, about the middle between two places (px).
pub(crate) fn below(sheet: &mut Sheet, ticks: Vec<Tick>, [left, right]: [f64; 2], y: f64, label: &str) {
    for Tick { place, number } in apart(ticks, width) {
        let length = if number.is_some() { 5.0 } else { 3.0 };
        sheet.line(&[[place, y], [place, y + length]], Stroke { colour: "black", width: 1.0, dashes: "" });
        if let Some(number) = number {
            sheet.words(&number, [place, y + 18.0], Anchor::Middle, "black");
        }
    }
    sheet.label(label, [f64::midpoint(left, right), y + 38.0]);
}

/// Ticks at the left of the data, at a place (px).
pub(crate) fn left(sheet: &mut Sheet, ticks: Vec<Tick>, x: f64) {
    for Tick { place, number } in apart(ticks, |_| HEIGHT) {
        let length = if number.is_some() { 5.0 } else { 3.0 };
        sheet.line(&[[x - length, place], [x, place]], Stroke { colour: "black", width: 1.0, dashes: "" });
        if let Some(number) = number {
            sheet.words(&number, [x - 8.0, place + 4.0], Anchor::End, "black");
        }
    }
}

/// The same ticks, without numbers that would touch others; `extent` is what a number takes along the axis (px).
fn apart(mut ticks: Vec<Tick>, extent: impl Fn(&str) -> f64) -> Vec<Tick> {
    let mut last: Option<[f64; 2]> = None;
    for tick in &mut ticks {
        let Some(half) = tick.number.as_deref().map(|number| 0.5 * extent(number)) else { continue };
        let is_taken = |[place, other]: [f64; 2]| (tick.place - place).abs() < other + half + FREE;
        if last.is_some_and(is_taken) {
            tick.number = None;
        } else {
            last = Some([tick.place, half]);
        }
    }
    ticks
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_numbers_touch() {
        let ticks = [0.0, 10.0, 30.0].map(|place| Tick { place, number: Some("1".to_owned()) }).to_vec();
        let kept = apart(ticks, |_| 12.0).into_iter().map(|tick| tick.number.is_some());
        assert_eq!(kept.collect::<Vec<_>>(), [true, false, true]);
    }
}
