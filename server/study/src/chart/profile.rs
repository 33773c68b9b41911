//! A performance profile (Dolan and Moré 2002): what each method costs on each of several scenes, over what the cheapest costs there.

use std::cmp::Reverse;

use nappe_sim::math::Precision;

use super::{of_cloth::Chart, row::Row};

/// A run on a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The name of its method in tables.
    pub method: String,
    /// The same as a reader writes it.
    pub name: String,
    /// Of positions and velocities.
    pub precision: Precision,
    /// Whether it is within the tolerance.
    pub is_right: bool,
    /// Seconds per simulated second.
    pub seconds: Option<f64>,
    /// Evaluations of forces and products.
    pub count: u64,
}

/// What a method costs on a scene, by the cheapest of its runs that are accurate enough; nothing where none is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Seconds per simulated second.
    pub seconds: Option<f64>,
    /// The same over those of the cheapest method.
    pub seconds_ratio: Option<f64>,
    /// Evaluations of forces and products.
    pub count: Option<u64>,
    /// The same over those of the method that takes the fewest.
    pub count_ratio: Option<f64>,
}

/// A method in a precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// The name of the method in tables.
    pub method: String,
    /// The same as a reader writes it.
    pub name: String,
    /// Of positions and velocities.
    pub precision: Precision,
    /// What it costs on each scene.
    pub costs: Vec<Cost>,
}

/// Methods over several scenes.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Error (m) within which a run is accurate enough.
    pub tolerance: f64,
    /// Names of the scenes.
    pub scenes: Vec<String>,
    /// Names of those on which methods were not followed to their ends.
    pub cut: Vec<String>,
    /// By the area below their shares over the logarithm of the factor, the largest first.
    pub lines: Vec<Line>,
}

/// The runs of a chart, but for the scene as it is written. What is nearer to the reference than that is known is not ranked.
pub fn runs(chart: &Chart) -> Vec<Run> {
    let run = |row: &Row| Run {
        method: row.stepped.name(),
        name: row.stepped.reader_name(),
        precision: row.stepped.precision(),
        is_right: row.is_ranked() && row.told().is_some_and(|error| error <= chart.tolerance),
        seconds: row.seconds,
        count: row.count(),
    };
    chart.rows.iter().filter(|row| !row.own).map(run).collect()
}

impl Profile {
    /// That of scenes by their names, with the runs on each that are accurate enough or not within an error (m).
    pub fn new(tolerance: f64, scenes: &[(String, &[Run])]) -> Self {
        let mut lines: Vec<Line> = Vec::new();
        for (scene, (_, runs)) in scenes.iter().enumerate() {
            for run in *runs {
                let is_its = |line: &Line| line.method == run.method && line.precision == run.precision;
                let place = lines.iter().position(is_its).unwrap_or_else(|| {
                    lines.push(Line {
                        method: run.method.clone(),
                        name: run.name.clone(),
                        precision: run.precision,
                        costs: vec![Cost::default(); scenes.len()],
                    });
                    lines.len() - 1
                });
                if run.is_right {
                    lines[place].costs[scene].take(run);
                }
            }
        }
        for scene in 0..scenes.len() {
            rate(&mut lines, scene);
        }
        let scenes = scenes.iter().map(|(name, _)| name.clone()).collect();
        let mut profile = Self { tolerance, scenes, cut: Vec::new(), lines };
        let largest = profile.largest_ratio();
        profile.lines.sort_by(|a, b| {
            let areas = b.area(largest).total_cmp(&a.area(largest));
            areas.then_with(|| Reverse(a.within(1.0)).cmp(&Reverse(b.within(1.0))))
        });
        profile
    }

    /// The largest ratio of seconds; 1 without any.
    pub fn largest_ratio(&self) -> f64 {
        self.lines.iter().flat_map(Line::ratios).fold(1.0, f64::max)
    }

    /// Names of the scenes on which nothing is accurate enough.
    pub fn unsolved(&self) -> Vec<String> {
        let is_unsolved =
            |scene: usize| self.lines.iter().all(|line| line.costs[scene].seconds_ratio.is_none());
        let named = self.scenes.iter().enumerate().filter(|(scene, _)| is_unsolved(*scene));
        named.map(|(_, name)| name.clone()).collect()
    }
}

impl Cost {
    /// Takes a run into account that is accurate enough.
    fn take(&mut self, run: &Run) {
        if let Some(seconds) = run.seconds.filter(|seconds| seconds.is_finite() && *seconds > 0.0) {
            self.seconds = Some(self.seconds.map_or(seconds, |least| least.min(seconds)));
        }
        if run.count > 0 {
            self.count = Some(self.count.map_or(run.count, |least| least.min(run.count)));
        }
    }
}

/// Gives all methods their ratios on a scene.
fn rate(lines: &mut [Line], scene: usize) {
    let seconds = lines.iter().filter_map(|line| line.costs[scene].seconds).reduce(f64::min);
    let count = lines.iter().filter_map(|line| line.costs[scene].count).min();
    for line in lines {
        let cost = &mut line.costs[scene];
        cost.seconds_ratio = cost.seconds.zip(seconds).map(|(own, least)| own / least);
        cost.count_ratio = cost.count.zip(count).map(|(own, least)| own as f64 / least as f64);
    }
}

impl Line {
    /// Its ratios of seconds, of the scenes on which it is accurate enough.
    pub fn ratios(&self) -> impl Iterator<Item = f64> {
        self.costs.iter().filter_map(|cost| cost.seconds_ratio)
    }

    /// On how many scenes it takes at most so many times the seconds of the cheapest.
    pub fn within(&self, factor: f64) -> usize {
        self.ratios().filter(|ratio| *ratio <= factor).count()
    }

    /// The area below its share of the scenes over the natural logarithm of the factor, from 1 to the largest ratio.
    pub fn area(&self, largest: f64) -> f64 {
        self.ratios().map(|ratio| (largest / ratio).ln()).sum::<f64>() / self.costs.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn right(method: &str, seconds: f64, count: u64) -> Run {
        let (method, name) = (method.to_owned(), method.to_owned());
        Run { method, name, precision: Precision::F64, is_right: true, seconds: Some(seconds), count }
    }

    fn wrong(method: &str, seconds: f64, count: u64) -> Run {
        Run { is_right: false, ..right(method, seconds, count) }
    }

    /// Three scenes: a is the cheapest on the first, b on the second, c comes late, and nothing is right on the third.
    fn example() -> Profile {
        let first = [
            right("a", 1.0, 40),
            right("a", 3.0, 90),
            right("b", 5.0, 10),
            right("b", 2.0, 30),
            wrong("b", 0.1, 1),
        ];
        let second = [right("a", 6.0, 60), right("b", 2.0, 20), right("c", 8.0, 5)];
        let third = [wrong("a", 1.0, 1), wrong("c", 1.0, 1)];
        let names = ["one", "two", "three"].map(str::to_owned);
        let runs = [&first[..], &second[..], &third[..]];
        Profile::new(1e-3, &names.into_iter().zip(runs).collect::<Vec<_>>())
    }

    #[test]
    fn ratios_are_those_to_the_cheapest_run_that_is_right() {
        let profile = example();
        let of = |method: &str| {
            let line = profile.lines.iter().find(|line| line.method == method).expect("a line");
            line.costs.iter().map(|cost| (cost.seconds_ratio, cost.count_ratio)).collect::<Vec<_>>()
        };
        assert_eq!(of("a"), [(Some(1.0), Some(4.0)), (Some(3.0), Some(12.0)), (None, None)]);
        assert_eq!(of("b"), [(Some(2.0), Some(1.0)), (Some(1.0), Some(4.0)), (None, None)]);
        assert_eq!(of("c"), [(None, None), (Some(4.0), Some(1.0)), (None, None)]);
        assert_eq!((profile.largest_ratio(), profile.unsolved()), (4.0, vec!["three".to_owned()]));
    }

    #[test]
    fn shares_count_scenes_within_a_factor_and_the_largest_area_comes_first() {
        let profile = example();
        let names: Vec<_> = profile.lines.iter().map(|line| line.method.as_str()).collect();
        assert_eq!(names, ["b", "a", "c"]);
        let counts: Vec<_> =
            profile.lines.iter().map(|line| [1.0, 2.0, 3.0, 4.0].map(|factor| line.within(factor))).collect();
        assert_eq!(counts, [[1, 2, 2, 2], [1, 1, 2, 2], [0, 0, 0, 1]]);
        // b: (ln 4 + ln 2) / 3; a: (ln 4 + ln 4/3) / 3.
        let areas = profile.lines.iter().map(|line| line.area(4.0));
        let expected = [8.0_f64.ln() / 3.0, (16.0_f64 / 3.0).ln() / 3.0, 0.0];
        for (area, expected) in areas.zip(expected) {
            assert!((area - expected).abs() < 1e-12, "{area}, not {expected}");
        }
    }

    #[test]
    fn methods_that_are_right_nowhere_have_no_ratio() {
        let only = [wrong("a", 1.0, 1)];
        let profile = Profile::new(1e-3, &[("one".to_owned(), &only[..])]);
        assert_eq!((profile.lines.len(), profile.largest_ratio()), (1, 1.0));
        assert_eq!(profile.unsolved(), ["one"]);
        assert!(Profile::new(1e-3, &[]).lines.is_empty());
    }
}
