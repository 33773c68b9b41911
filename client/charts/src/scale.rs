//! Scales: from values to places along an axis (px), and the ticks between.

use crate::canvas::tick;

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
        let step = [1.0, 2.0, 5.0].map(|times| times * decade).into_iter().find(|step| *step >= least);
        let step = step.unwrap_or(10.0 * decade);
        let first = (low / step).ceil();
        let count = ((high / step).floor() - first).clamp(0.0, PARTS + 1.0) as u32;
        let tick = |i: u32| {
            let number = (first + f64::from(i)) * step;
            Tick { place: self.at(number), number: Some(written(number, step)) }
        };
        (0..=count).map(tick).collect()
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

/// A multiple of a step, with as many digits as tell it from the next one.
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

    #[test]
    fn ticks_of_close_numbers_have_the_digits_that_tell_them_apart() {
        let numbers = |low: f64, high: f64| numbers(Spacing::Even, [low, high]);
        assert_eq!(numbers(12.31, 12.39), ["12.32", "12.34", "12.36", "12.38"]);
        assert_eq!(numbers(-3.0, 41.0), ["0", "10", "20", "30", "40"]);
        let small = numbers(0.0, 2.6e-8);
        assert_eq!((small.len(), small[3].as_str()), (6, "1.5e-8"));
    }
}
