//! A step that was timed, and what a row of samples says.

use std::collections::BTreeMap;

use nappe_sim::{
    linalg::SolveReport,
    report::{Stage, StageSeconds, StepReport, SurfaceReport},
};

/// One step, timed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    /// The whole step (s).
    pub(crate) seconds: f64,
    /// Its stages (s).
    pub(crate) stages: StageSeconds,
    /// Steps of the snow within it; 0 without snow.
    pub(crate) substeps: u32,
    /// The linear solve within it, if there is one.
    pub(crate) solve: Option<SolveReport>,
    /// What kept surfaces of cloth apart, where anything did.
    pub(crate) surface: Option<SurfaceReport>,
}

impl Sample {
    /// What a step reports that took so many seconds, of which its stages took some.
    pub(crate) fn new(report: &StepReport, seconds: f64, stages: StageSeconds) -> Self {
        let substeps = report.snow.map_or(0, |snow| snow.substeps);
        Self { seconds, stages, substeps, solve: report.solve, surface: report.surface }
    }
}

/// The middle of the samples; of an even number, the mean of the two in the middle. 0 for none.
pub(crate) fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => 0.0,
        n if n % 2 == 0 => f64::midpoint(sorted[middle - 1], sorted[middle]),
        _ => sorted[middle],
    }
}

/// The smallest of the samples, which other programs disturbed least.
pub(crate) fn minimum(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(f64::INFINITY, f64::min)
}

/// The median of each stage (s).
fn median_stages(samples: &[Sample]) -> StageSeconds {
    std::array::from_fn(|stage| median(samples.iter().map(|sample| sample.stages[stage])))
}

/// The same by name, of each that takes any time.
pub(crate) fn named_stages(samples: &[Sample]) -> BTreeMap<&'static str, f64> {
    let named = Stage::ALL.into_iter().map(Stage::name).zip(median_stages(samples));
    named.filter(|(_, seconds)| *seconds > 0.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle_sample() {
        assert_eq!(median([3.0, 1.0, 2.0]).to_bits(), 2.0_f64.to_bits());
        assert_eq!(median([4.0, 1.0, 2.0, 3.0]).to_bits(), 2.5_f64.to_bits());
        assert_eq!(minimum([3.0, 1.0, 2.0]).to_bits(), 1.0_f64.to_bits());
    }
}
