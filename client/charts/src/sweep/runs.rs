//! The runs of a sweep, as its picture is told of them.

use crate::{scale::Spacing, words};

/// Numbers that are larger (in size) are drawn as if they were none.
pub(super) const LARGEST: f64 = 1e100;

/// How many times the least of a quantity the greatest is, from which on it is drawn by logarithms.
const WIDE: f64 = 100.0;

/// A sweep of a scene over one key or two.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// Name of the scene.
    pub scene: String,
    /// The keys that are set, one or two.
    pub keys: Vec<String>,
    /// Their units, as many; empty where there is none.
    pub units: Vec<String>,
    /// Names of what is drawn of each run, at least one; of a sweep over two keys the first alone is drawn.
    pub quantities: Vec<String>,
    /// The runs that have ended.
    pub runs: Vec<SweepRun>,
    /// How many runs the sweep has, those that have not ended among them.
    pub count: usize,
}

/// A run of a sweep.
#[derive(Clone, Debug)]
pub struct SweepRun {
    /// What the keys are set to, as it was written.
    pub values: Vec<String>,
    /// The quantities, in their units; none where the run did not come to its end.
    pub measured: Option<Vec<f64>>,
}

impl SweepRun {
    /// What its key at a place is set to.
    pub(super) fn value(&self, key: usize) -> &str {
        self.values.get(key).map_or("", String::as_str)
    }

    /// The quantity at a place, if it is a number.
    pub(super) fn quantity(&self, place: usize) -> Option<f64> {
        let measured = self.measured.as_ref()?.get(place).copied();
        measured.filter(|number| number.abs() <= LARGEST)
    }
}

impl Sweep {
    /// A key as it stands at its axis, with its unit.
    pub(super) fn label(&self, key: usize) -> String {
        let name = self.keys.get(key).map_or("", String::as_str);
        let unit = self.units.get(key).filter(|unit| !unit.is_empty());
        unit.map_or_else(|| name.to_owned(), |unit| format!("{name} ({unit})"))
    }

    /// How a quantity is spaced: by logarithms where all of it is above 0 and spans two decades.
    pub(super) fn spacing(&self, place: usize) -> Spacing {
        match self.ends(place) {
            Some([low, high]) if low > 0.0 && high >= WIDE * low => Spacing::Log,
            _ => Spacing::Even,
        }
    }

    /// The least and the greatest of a quantity.
    pub(super) fn ends(&self, place: usize) -> Option<[f64; 2]> {
        let (least, greatest) = self.extremes(place)?;
        Some([least.1, greatest.1])
    }

    /// The runs of which a quantity is least and greatest.
    fn extremes(&self, place: usize) -> Option<(Extreme<'_>, Extreme<'_>)> {
        let known = || self.runs.iter().filter_map(move |run| Some((run, run.quantity(place)?)));
        let least = known().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let greatest = known().max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some((least, greatest))
    }

    /// How many runs finished, and where a quantity is least and greatest, in sentences.
    pub(super) fn sentence(&self, place: usize) -> String {
        let ok = self.runs.iter().filter(|run| run.measured.is_some()).count();
        let failed = self.runs.len() - ok;
        let mut text = format!("{ok} of {} runs finished", self.count);
        if failed > 0 {
            let verb = if failed == 1 { "did not, and is crossed" } else { "did not, and are crossed" };
            text = format!("{text}; {failed} {verb}");
        }
        let open = self.count.saturating_sub(self.runs.len());
        if open > 0 {
            text = format!("{text}; {open} have not run yet");
        }
        let Some((least, greatest)) = self.extremes(place) else { return text + "." };
        // As many digits as tell them apart.
        let is_told = short(least.1) != short(greatest.1);
        let at = |(run, number): &Extreme<'_>| {
            let values = self.keys.iter().zip(&run.values);
            let values: Vec<String> = values.map(|(key, value)| format!("{key} = {value}")).collect();
            let number = if is_told { short(*number) } else { format!("{number:?}") };
            format!("{number}, at {}", values.join(", "))
        };
        let name = self.quantities.get(place).map_or("", String::as_str);
        format!("{text}. The least {name} is {}; the greatest is {}.", at(&least), at(&greatest))
    }
}

/// A run and a number of it.
type Extreme<'a> = (&'a SweepRun, f64);

/// A number with three digits that count, with an exponent where it is small or large.
pub(super) fn short(number: f64) -> String {
    if number == 0.0 || (1e-4..1e6).contains(&number.abs()) {
        words::number(number)
    } else {
        format!("{number:.2e}")
    }
}
