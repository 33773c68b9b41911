//! Scales: from values to places along an axis (px), and the ticks between.

use crate::{canvas::tick, words::two};

/// Spans in decades below which ticks between decades have numbers too.
const FEW: f64 = 2.5;
/// Decades that have numbers, at most.
const MANY: i32 = 9;
/// Parts that ticks divide an even axis into, at most.
const PARTS: f64 = 6.0;

/// How values are spaced along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Spacing {
    Even,
    Log,
}

impl Spacing {
    /// What a value is on a ruler.
    pub(crate) fn coordinate(self, value: f64) -> f64 {
        match self {
            Self::Even => value,
            Self::Log => value.log10(),
        }
    }
}

/// A scale between two places.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scale {
    pub(crate) spacing: Spacing,
    /// Coordinates of both ends, the less first.
    pub(crate) ends: [f64; 2],
    /// Where both ends are (px).
    pub(crate) places: [f64; 2],
}

/// A tick, and its number if it has one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tick {
    pub(crate) place: f64,
    pub(crate) number: Option<String>,
}

impl Scale {
    /// Where a coordinate is (px); beyond an end, that end.
    pub(crate) fn place(&self, coordinate: f64) -> f64 {
        let [low, high] = self.ends;
        let share = ((coordinate - low) / (high - low)).clamp(0.0, 1.0);
        self.places[0] + share * (self.places[1] - self.places[0])
    }

    /// Where a value is (px); beyond an end, that end.
    pub(crate) fn at(&self, value: f64) -> f64 {
        self.place(self.spacing.coordinate(value))
    }

    /// Whether a value lies between the ends.
    pub(crate) fn holds(&self, value: f64) -> bool {
        (self.ends[0]..=self.ends[1]).contains(&self.spacing.coordinate(value))
    }

    /// Round values between the ends.
    pub(crate) fn ticks(&self) -> Vec<Tick> {
        match self.spacing {
            Spacing::Even => self.even_ticks(),
            Spacing::Log => self.log_ticks(),
        }
    }

    fn even_ticks(&self) -> Vec<Tick> {
        let [low, high] = self.ends;
        let least = (high - low) / PARTS;
        let decade = 10_f64.powf(least.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|times| times * decade).into_iter().find(|step| *step >= least);
        let step = step.unwrap_or(10.0 * decade);
        let [first, last] = [(low / step).ceil() as i32, (high / step).floor() as i32];
        let of = |i: i32| {
            let value = f64::from(i) * step;
            Tick { place: self.at(value), number: Some(two(value)) }
        };
        (first..=last).map(of).collect()
    }

    fn log_ticks(&self) -> Vec<Tick> {
        let [low, high] = self.ends;
        let [first, last] = [low.floor() as i32, high.ceil() as i32];
        let stride = 1 + (last - first) / MANY;
        let is_short = high - low < FEW;
        let mut ticks = Vec::new();
        for decade in first..=last {
            for digit in 1..=9 {
                // Read, not multiplied, so that its number is written in full.
                let value: f64 = format!("{digit}e{decade}").parse().unwrap_or(f64::NAN);
                if !self.holds(value) {
                    continue;
                }
                let has_number = match digit {
                    1 => (decade - first) % stride == 0,
                    2 | 5 => is_short,
                    _ => false,
                };
                let number = has_number.then(|| tick(value));
                ticks.push(Tick { place: self.at(value), number });
            }
        }
        ticks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(spacing: Spacing, ends: [f64; 2]) -> Vec<String> {
        let scale = Scale { spacing, ends, places: [0.0, 100.0] };
        scale.ticks().into_iter().filter_map(|tick| tick.number).collect()
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(numbers(Spacing::Log, [-3.1, 1.2]), ["0.001", "0.01", "0.1", "1", "10"]);
        assert_eq!(numbers(Spacing::Log, [-0.1, 1.2]), ["1", "2", "5", "10"]);
        assert_eq!(numbers(Spacing::Even, [-0.5, 40.5]), ["0", "10", "20", "30", "40"]);
    }

    #[test]
    fn places_stay_between_the_ends() {
        let scale = Scale { spacing: Spacing::Log, ends: [-1.0, 1.0], places: [10.0, 30.0] };
        assert_eq!([0.0, 0.1, 1.0, 10.0, 1e9].map(|value| scale.at(value)), [10.0, 10.0, 20.0, 30.0, 30.0]);
    }
}
