//! A part of the runs of a sweep, which a job of its own computes: every so-manieth run.

use std::fmt;

/// Parts of a sweep, at most: no sweep has more combinations.
const MOST: usize = 100_000;

/// One of several parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Part {
    /// Which of them, from 1 on.
    number: usize,
    /// How many there are.
    of: usize,
}

impl Part {
    /// The one part of a sweep that is not divided.
    pub(crate) const WHOLE: Self = Self { number: 1, of: 1 };

    /// `3/20`: the third of twenty parts.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(number, of)| {
            Some(Self { number: number.trim().parse().ok()?, of: of.trim().parse().ok()? })
        });
        numbers
            .filter(|part| (1..=MOST).contains(&part.of) && (1..=part.of).contains(&part.number))
            .ok_or_else(|| {
                format!("'{text}' is no part; allowed: K/N, such as 3/20, with K from 1 to N and N to {MOST}")
            })
    }

    /// How many parts there are.
    pub(crate) fn of(self) -> usize {
        self.of
    }

    /// Whether a run is in it, by its number in the whole sweep.
    pub(crate) fn has(self, run: usize) -> bool {
        run % self.of == self.number - 1
    }

    /// How many of so many runs are in it.
    pub(crate) fn count(self, runs: usize) -> usize {
        (runs + self.of - self.number) / self.of
    }

    /// All parts that the sweep of this one has.
    pub(crate) fn all(self) -> impl Iterator<Item = Self> {
        (1..=self.of).map(move |number| Self { number, ..self })
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_run_is_in_one_part() {
        for (of, runs) in [(1, 7), (3, 7), (3, 6), (20, 7), (2, 0)] {
            let parts: Vec<Part> = Part { number: 1, of }.all().collect();
            assert_eq!(parts.len(), of);
            for run in 0..runs {
                assert_eq!(parts.iter().filter(|part| part.has(run)).count(), 1, "run {run} of {of} parts");
            }
            for part in parts {
                let own = (0..runs).filter(|run| part.has(*run)).count();
                assert_eq!(part.count(runs), own, "{part} of {runs} runs");
            }
        }
        assert_eq!(Part::WHOLE.count(9), 9);
    }

    #[test]
    fn what_is_no_part_is_refused_and_what_is_one_is_written_back() {
        for wrong in ["", "3", "0/3", "4/3", "1/0", "-1/3", "a/3", "1/3/3", "1/100001"] {
            assert!(Part::parse(wrong).is_err(), "{wrong}");
        }
        for right in ["1/1", "3/20", "20/20"] {
            assert_eq!(Part::parse(right).expect("a part").to_string(), right);
        }
    }
}
