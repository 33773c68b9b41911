//! The values of a key along an axis: numbers where they lie, other values at places in order.

use std::collections::BTreeSet;

use super::runs::{LARGEST, Sweep};
use crate::{
    canvas::{Anchor, Stroke, width},
    panels::Bands,
    scale::{Scale, Spacing, Tick},
    sheet::Sheet,
};

/// How many times the least number the greatest is, from which on an axis is logarithmic.
const WIDE: f64 = 20.0;
/// Numbers that are all written along their axis, at most; of more, round ones between them are.
const FEW: usize = 12;
/// Parts that round numbers divide an axis into, at most.
const PARTS: f64 = 6.0;
/// Letters of a value that are written, at most.
const LETTERS: usize = 24;
/// Height of a number beside an axis (px), and what stays free between two (px).
const HEIGHT: f64 = 10.0;
const FREE: f64 = 4.0;

/// What the values of a key are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Numbers,
    Others,
}

/// The values of a key.
pub(super) struct Values {
    kind: Kind,
    /// Numbers along the axis, growing, with the values as they were written.
    known: Vec<(f64, String)>,
    spacing: Spacing,
}

impl Values {
    /// Those of the key at a place.
    pub(super) fn of(sweep: &Sweep, key: usize) -> Self {
        let mut seen = BTreeSet::new();
        let all = sweep.runs.iter().map(|run| run.value(key));
        let texts: Vec<&str> = all.filter(|text| seen.insert(*text)).collect();
        let numbers: Option<Vec<f64>> = texts.iter().map(|text| number(text)).collect();
        let (kind, numbers) = match numbers {
            Some(numbers) => (Kind::Numbers, numbers),
            None => (Kind::Others, (0..texts.len()).map(|place| place as f64).collect()),
        };
        let mut known: Vec<(f64, String)> =
            numbers.into_iter().zip(texts.iter().map(|text| (*text).to_owned())).collect();
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
        let is_wide = match (known.first(), known.last()) {
            (Some((low, _)), Some((high, _))) => *low > 0.0 && *high >= WIDE * low,
            _ => false,
        };
        let spacing = if is_wide && kind == Kind::Numbers { Spacing::Log } else { Spacing::Even };
        Self { kind, known, spacing }
    }

    pub(super) fn are_numbers(&self) -> bool {
        self.kind == Kind::Numbers
    }

    pub(super) fn count(&self) -> usize {
        self.known.len()
    }

    /// The number of a value along the axis.
    pub(super) fn number(&self, value: &str) -> Option<f64> {
        match self.kind {
            Kind::Numbers => number(value),
            Kind::Others => self.known.iter().find(|(_, known)| known == value).map(|(number, _)| *number),
        }
    }

    /// A band for each value.
    pub(super) fn bands(&self) -> Bands {
        Bands::of(self.known.iter().map(|(number, _)| *number), self.spacing)
    }

    /// The scale between two places (px), with room beside the first and the last value.
    pub(super) fn scale(&self, places: [f64; 2]) -> Scale {
        let at =
            |end: Option<&(f64, String)>| end.map_or(0.0, |(number, _)| self.spacing.coordinate(*number));
        scale(self.spacing, [at(self.known.first()), at(self.known.last())], places)
    }

    /// The scale of its bands between two places (px).
    pub(super) fn scale_of(&self, bands: &Bands, places: [f64; 2]) -> Scale {
        let ends = bands.ends();
        if ends[0] < ends[1] { Scale { spacing: self.spacing, ends, places } } else { self.scale(places) }
    }

    /// Ticks at values, or at round numbers between many.
    pub(super) fn ticks(&self, scale: &Scale) -> Vec<Tick> {
        if self.kind == Kind::Numbers && self.known.len() > FEW {
            return ticks(scale);
        }
        let tick =
            |(number, text): &(f64, String)| Tick { place: scale.at(*number), number: Some(cut(text)) };
        self.known.iter().map(tick).collect()
    }
}

/// A value as a number.
fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|number: &f64| number.abs() <= LARGEST)
}

/// The first letters of a value.
fn cut(text: &str) -> String {
    if text.chars().count() <= LETTERS {
        return text.to_owned();
    }
    text.chars().take(LETTERS - 3).collect::<String>() + "..."
}

/// A scale with room beside both ends, which may be one.
pub(super) fn scale(spacing: Spacing, [low, high]: [f64; 2], places: [f64; 2]) -> Scale {
    let room = match (high - low, low.abs()) {
        (span, _) if span > 0.0 => 0.05 * span,
        (_, size) if size > 0.0 => 0.1 * size,
        _ => 1.0,
    };
    Scale { spacing, ends: [low - room, high + room], places }
}

/// Round numbers between the ends of a scale, with as many digits as tell them apart.
pub(super) fn ticks(scale: &Scale) -> Vec<Tick> {
    if scale.spacing == Spacing::Log {
        return scale.ticks();
    }
    let [low, high] = scale.ends;
    let least = (high - low) / PARTS;
    let decade = 10_f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0].map(|times| times * decade).into_iter().find(|step| *step >= least);
    let step = step.unwrap_or(10.0 * decade);
    let first = (low / step).ceil();
    let count = ((high / step).floor() - first).clamp(0.0, PARTS + 1.0) as u32;
    let tick = |i: u32| {
        let number = (first + f64::from(i)) * step;
        Tick { place: scale.at(number), number: Some(written(number, step)) }
    };
    (0..=count).map(tick).collect()
}

/// A multiple of a step.
fn written(number: f64, step: f64) -> String {
    let digits = (-step.log10().floor()).max(0.0);
    if digits <= 5.0 && number.abs() < 1e6 {
        let digits = digits as usize;
        return format!("{number:.digits$}");
    }
    let decades = [number.abs().max(step), step].map(|number| number.log10().floor());
    let digits = (decades[0] - decades[1]).clamp(0.0, 15.0) as usize;
    format!("{number:.digits$e}")
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

/// Draws ticks below the data, at a height (px).
pub(super) fn draw_below(sheet: &mut Sheet, ticks: Vec<Tick>, y: f64) {
    for Tick { place, number } in apart(ticks, width) {
        sheet.line(&[[place, y], [place, y + 5.0]], Stroke { colour: "black", width: 1.0, dashes: "" });
        if let Some(number) = number {
            sheet.words(&number, [place, y + 18.0], Anchor::Middle, "black");
        }
    }
}

/// Draws ticks at the left of the data, at a place (px).
pub(super) fn draw_left(sheet: &mut Sheet, ticks: Vec<Tick>, x: f64) {
    crate::axes::left(sheet, &apart(ticks, |_| HEIGHT), x);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::runs::SweepRun;

    fn values(texts: &[&str]) -> Values {
        let run = |text: &&str| SweepRun { values: vec![(*text).to_owned()], measured: None };
        let sweep = Sweep {
            scene: String::new(),
            keys: vec![String::new()],
            quantities: vec![String::new()],
            runs: texts.iter().map(run).collect(),
            count: texts.len(),
        };
        Values::of(&sweep, 0)
    }

    #[test]
    fn numbers_are_sorted_and_other_values_keep_their_order() {
        let numbers = values(&["5", "-1", "1e1", "5"]);
        assert!(numbers.are_numbers() && numbers.count() == 3);
        assert_eq!(numbers.number("1e1"), Some(10.0));
        let texts = values(&["b", "1", "a"]);
        assert!(!texts.are_numbers());
        assert_eq!(
            ["b", "1", "a", "c"].map(|text| texts.number(text)),
            [Some(0.0), Some(1.0), Some(2.0), None]
        );
        assert_eq!(
            (values(&["1", "20"]).spacing, values(&["0", "20"]).spacing),
            (Spacing::Log, Spacing::Even)
        );
    }

    #[test]
    fn ticks_of_close_numbers_have_the_digits_that_tell_them_apart() {
        let numbers = |low: f64, high: f64| {
            let scale = Scale { spacing: Spacing::Even, ends: [low, high], places: [0.0, 100.0] };
            ticks(&scale).into_iter().filter_map(|tick| tick.number).collect::<Vec<_>>()
        };
        assert_eq!(numbers(12.31, 12.39), ["12.32", "12.34", "12.36", "12.38"]);
        assert_eq!(numbers(-3.0, 41.0), ["0", "10", "20", "30", "40"]);
        let small = numbers(0.0, 2.6e-8);
        assert_eq!((small.len(), small[3].as_str()), (6, "1.5e-8"));
    }

    #[test]
    fn no_scale_is_empty_and_no_two_numbers_touch() {
        for ends in [[0.0, 0.0], [1e90, 1e90], [-3.0, -3.0]] {
            let scale = scale(Spacing::Even, ends, [0.0, 100.0]);
            assert!(scale.ends[0] < scale.ends[1], "{ends:?}");
            assert!((scale.at(ends[0]) - 50.0).abs() < 1e-9, "{ends:?}");
        }
        let ticks = [0.0, 10.0, 30.0].map(|place| Tick { place, number: Some("1".to_owned()) }).to_vec();
        let kept = apart(ticks, |_| 12.0).into_iter().map(|tick| tick.number.is_some());
        assert_eq!(kept.collect::<Vec<_>>(), [true, false, true]);
    }
}
