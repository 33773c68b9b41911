//! The values of a key along an axis: numbers where they lie, other values at places in order.

use std::collections::BTreeSet;

use super::runs::{LARGEST, Sweep};
use crate::{
    panels::Bands,
    scale::{Scale, Spacing, Tick},
};

/// How many times the least number the greatest is, from which on an axis is logarithmic.
const WIDE: f64 = 20.0;
/// Numbers that are all written along their axis, at most; of more, round ones between them are.
const FEW: usize = 12;
/// Letters of a value that are written, at most.
const LETTERS: usize = 24;

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
            return scale.ticks();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::runs::SweepRun;

    fn values(texts: &[&str]) -> Values {
        let run = |text: &&str| SweepRun { values: vec![(*text).to_owned()], measured: None };
        let sweep = Sweep {
            scene: String::new(),
            keys: vec![String::new()],
            units: vec![String::new()],
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
    fn no_scale_is_empty() {
        for ends in [[0.0, 0.0], [1e90, 1e90], [-3.0, -3.0]] {
            let scale = scale(Spacing::Even, ends, [0.0, 100.0]);
            assert!(scale.ends[0] < scale.ends[1], "{ends:?}");
            assert!((scale.at(ends[0]) - 50.0).abs() < 1e-9, "{ends:?}");
        }
    }
}
