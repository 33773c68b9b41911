//! The cells of a map, method by method, and where they lie.

use nappe_study::{Across, Map, Method, Stability, StabilityRow};

use crate::scale::Spacing;

/// Share of an axis that the band of 0 takes at least, where the axis is logarithmic.
const ZERO: f64 = 0.06;
/// Half of a band that has no neighbour.
const ALONE: f64 = 0.1;

/// Values, each with a band that reaches halfway to its neighbours.
#[derive(Clone, Debug)]
pub(crate) struct Bands {
    pub(crate) spacing: Spacing,
    /// In ascending order.
    values: Vec<f64>,
    /// Coordinates of the ends of bands, one more than values.
    edges: Vec<f64>,
}

impl Bands {
    /// The bands of values; 0, which has no logarithm, gets one below the others.
    pub(crate) fn of(values: impl Iterator<Item = f64>, spacing: Spacing) -> Self {
        let mut values: Vec<f64> = values.collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        let is_apart = |value: f64| spacing == Spacing::Log && value <= 0.0;
        let placed: Vec<f64> = values
            .iter()
            .filter(|value| !is_apart(**value))
            .map(|value| spacing.coordinate(*value))
            .collect();
        let mut edges = edges(&placed);
        if values.first().is_some_and(|value| is_apart(*value)) {
            let span = edges[edges.len() - 1] - edges[0];
            let least = edges.get(1).map_or(2.0 * ALONE, |next| next - edges[0]);
            edges.insert(0, edges[0] - least.max(ZERO * span));
        }
        Self { spacing, values, edges }
    }

    /// Coordinates of the ends of all.
    pub(crate) fn ends(&self) -> [f64; 2] {
        [self.edges[0], self.edges[self.edges.len() - 1]]
    }

    /// Coordinates of the ends of the band of a value.
    pub(crate) fn band(&self, value: f64) -> Option<[f64; 2]> {
        let place = self.values.iter().position(|known| *known == value)?;
        Some([self.edges[place], self.edges[place + 1]])
    }

    /// Coordinates of the ends of the band of 0, where it lies apart from the others.
    pub(crate) fn apart(&self) -> Option<[f64; 2]> {
        (self.spacing == Spacing::Log).then(|| self.band(0.0)).flatten()
    }

    /// Coordinates of the ends of the others.
    pub(crate) fn others(&self) -> [f64; 2] {
        let [low, high] = self.ends();
        [self.apart().map_or(low, |[_, above]| above), high]
    }
}

/// Halfway between neighbours, and as far beyond the first and the last; of no values, an edge alone.
fn edges(placed: &[f64]) -> Vec<f64> {
    let (Some(first), Some(last)) = (placed.first(), placed.last()) else { return vec![0.0] };
    let between: Vec<f64> = placed.windows(2).map(|pair| f64::midpoint(pair[0], pair[1])).collect();
    let below = between.first().map_or(ALONE, |edge| edge - first);
    let above = between.last().map_or(ALONE, |edge| last - edge);
    [first - below].into_iter().chain(between).chain([last + above]).collect()
}

/// The cells of a method.
#[derive(Clone, Debug)]
pub(crate) struct Panel<'a> {
    pub(crate) method: Method,
    pub(crate) rows: Vec<&'a StabilityRow>,
    /// Of its steps (ms).
    pub(crate) steps: Bands,
}

/// Whether a row belongs to a map.
pub(crate) fn has(map: Map, row: &StabilityRow) -> bool {
    match row.across {
        Some((Across::Damping | Across::DampingRatio, _)) => map == Map::Damping,
        Some((Across::Compression, _)) => map == Map::Compression,
        None => false,
    }
}

/// What a row varies beside the step, as it is drawn: a factor, a ratio, or percent.
pub(crate) fn value(row: &StabilityRow) -> f64 {
    match row.across {
        Some((Across::Compression, share)) => 100.0 * share,
        Some((Across::Damping | Across::DampingRatio, value)) => value,
        None => 0.0,
    }
}

/// How the values of a map are spaced.
pub(crate) const fn spacing(map: Map) -> Spacing {
    match map {
        Map::Damping => Spacing::Log,
        Map::Compression => Spacing::Even,
    }
}

/// The length of a row's steps (ms).
pub(crate) fn step(row: &StabilityRow) -> f64 {
    row.dt * 1e3
}

/// The cells of a map, in the order in which methods first appear.
pub(crate) fn of(stability: &Stability, map: Map) -> Vec<Panel<'_>> {
    let mut methods: Vec<(Method, Vec<&StabilityRow>)> = Vec::new();
    // Values at which nothing is known are left out: what is known has their room.
    let known: Vec<f64> =
        stability.rows.iter().filter(|row| has(map, row) && row.cut.is_none()).map(value).collect();
    let is_shown = |row: &&StabilityRow| has(map, row) && (known.is_empty() || known.contains(&value(row)));
    for row in stability.rows.iter().filter(is_shown) {
        match methods.iter_mut().find(|(method, _)| *method == row.method) {
            Some((_, rows)) => rows.push(row),
            None => methods.push((row.method, vec![row])),
        }
    }
    let mut panels = Vec::new();
    for (method, rows) in methods {
        let steps = Bands::of(rows.iter().map(|row| step(row)), Spacing::Log);
        panels.push(Panel { method, rows, steps });
    }
    panels
}

impl Panel<'_> {
    /// The cell of the shortest step that fails, at the least value.
    pub(crate) fn first_failure(&self) -> Option<&StabilityRow> {
        let failed = self.rows.iter().filter(|row| row.verdict.is_failure());
        let key = |row: &StabilityRow| (row.dt, value(row));
        let first = failed.min_by(|a, b| {
            let [a, b] = [key(a), key(b)];
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        first.copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_reach_halfway_and_zero_lies_below() {
        let bands = Bands::of([100.0, 1.0, 10.0, 0.0, 1.0].into_iter(), Spacing::Log);
        assert_eq!(bands.ends(), [-1.5, 2.5]);
        assert_eq!(bands.band(10.0), Some([0.5, 1.5]));
        assert_eq!(bands.apart(), Some([-1.5, -0.5]));
        assert_eq!(bands.others(), [-0.5, 2.5]);
        let even = Bands::of([0.0, 20.0].into_iter(), Spacing::Even);
        assert_eq!((even.ends(), even.apart()), ([-10.0, 30.0], None));
        assert_eq!(Bands::of([0.0].into_iter(), Spacing::Log).ends(), [-0.2, 0.0]);
    }
}
