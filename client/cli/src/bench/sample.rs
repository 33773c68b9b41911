//! A clock for the stages of a step, and what a row of samples says.
//!
//! The simulation library reads no clock: it calls [`StageClock::lap`] and the time is taken here.

use std::time::Instant;

use nappe_sim::{
    linalg::SolveReport,
    report::{Stage, StepReport, Stopwatch},
};

/// Seconds in each stage, in the order of [`Stage::ALL`].
pub(crate) type Stages = [f64; Stage::ALL.len()];

/// One step, timed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    /// The whole step (s).
    pub(crate) seconds: f64,
    /// Its stages (s).
    pub(crate) stages: Stages,
    /// Steps of the snow within it; 0 without snow.
    pub(crate) substeps: u32,
    /// The linear solve within it, if there is one.
    pub(crate) solve: Option<SolveReport>,
}

/// Times one step.
#[derive(Debug)]
pub(crate) struct StageClock {
    start: Instant,
    last: Instant,
    stages: Stages,
}

impl StageClock {
    /// A clock that starts now.
    pub(crate) fn start() -> Self {
        let start = Instant::now();
        Self { start, last: start, stages: Stages::default() }
    }

    /// Ends now, with what the step reports.
    pub(crate) fn stop(self, report: &StepReport) -> Sample {
        let seconds = self.start.elapsed().as_secs_f64();
        let substeps = report.snow.map_or(0, |snow| snow.substeps);
        Sample { seconds, stages: self.stages, substeps, solve: report.solve }
    }
}

impl Stopwatch for StageClock {
    fn lap(&mut self, stage: Stage) {
        let now = Instant::now();
        let index = Stage::ALL.iter().position(|known| *known == stage).expect("ALL holds every stage");
        self.stages[index] += (now - self.last).as_secs_f64();
        self.last = now;
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
pub(crate) fn median_stages(samples: &[Sample]) -> Stages {
    std::array::from_fn(|stage| median(samples.iter().map(|sample| sample.stages[stage])))
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

    #[test]
    fn the_stages_of_a_step_fit_in_the_step() {
        let mut clock = StageClock::start();
        clock.lap(Stage::Force);
        clock.lap(Stage::Solve);
        clock.lap(Stage::Force);
        let sample = clock.stop(&StepReport::default());
        assert!(sample.stages.iter().all(|seconds| *seconds >= 0.0));
        assert!(sample.stages.iter().sum::<f64>() <= sample.seconds);
    }
}
