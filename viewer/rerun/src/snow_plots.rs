//! Diagnostics of snow to time series, and the bound on its step to states and a log.
//!
//! Enters: `v1::Diagnostics` with a part of snow. Leaves: rows of scalars as for `plots`; a state and a line of
//! text whenever another bound binds.

use nappe_client::v1;

use crate::{
    error::{RerunError, refused},
    plots::{AMBER, BLUE, BROWN, GREEN, LIGHT, Plot, RED, Series, TEAL, VIOLET, stage_times},
    sdk::{RecordingStream, StateChange, TextLog, TextLogLevel},
};

/// The state: the name of the bound that binds.
pub(crate) const BOUND_STATE: &str = "states/time_bound";
/// The lines of text.
pub(crate) const BOUND_LOG: &str = "logs/time_bound";

const STAGES: &[Series] = &[
    ("sort", GREEN),
    ("particles_to_grid", RED),
    ("grid_update", BROWN),
    ("solve", VIOLET),
    ("grid_to_particles", BLUE),
    ("diagnose", AMBER),
];

/// Plots of scenes with snow, from top to bottom.
pub(crate) const SNOW: [Plot; 8] = [
    Plot {
        path: "plots/snow_dt",
        title: "Step of the snow (ms)",
        series: &[("dt", LIGHT), ("bound", RED)],
        values: |d| snow(d, |snow| vec![1e3 * snow.dt_seconds, 1e3 * snow.bound_seconds]),
    },
    Plot {
        path: "plots/snow_substeps",
        title: "Steps of the snow in a step",
        series: &[("steps", AMBER)],
        values: |d| snow(d, |snow| vec![f64::from(snow.substeps)]),
    },
    Plot {
        path: "plots/snow_counts",
        title: "Particles",
        series: &[("plastic", BLUE), ("inverted", RED), ("clamped", AMBER), ("ballistic", GREEN)],
        values: |d| {
            snow(d, |snow| {
                let counts =
                    [snow.plastic_count, snow.inverted_count, snow.clamped_count, snow.ballistic_count];
                counts.map(|count| count as f64).to_vec()
            })
        },
    },
    Plot {
        path: "plots/snow_plastic_ratio",
        title: "Plastic ratio J_P (1)",
        series: &[("smallest", BLUE), ("largest", AMBER)],
        values: |d| snow(d, |snow| vec![snow.min_plastic_ratio, snow.max_plastic_ratio]),
    },
    Plot {
        path: "plots/snow_mass",
        title: "Mass (kg)",
        series: &[("particles", LIGHT), ("grid", BLUE)],
        values: |d| snow(d, |snow| vec![snow.mass, snow.mass * (1.0 + snow.grid_mass_error)]),
    },
    Plot {
        path: "plots/snow_speed",
        title: "Fastest particle (m/s)",
        series: &[("speed", GREEN)],
        values: |d| snow(d, |snow| vec![snow.max_speed]),
    },
    Plot {
        path: "plots/snow_blocks",
        title: "Blocks of the grid",
        series: &[("blocks", TEAL)],
        values: |d| snow(d, |snow| vec![snow.block_count as f64]),
    },
    Plot {
        path: "plots/snow_stages",
        title: "Time of stages (ms)",
        series: STAGES,
        values: |d| d.snow.as_ref().and_then(|_| stage_times(d, STAGES)),
    },
];

fn snow(
    diagnostics: &v1::Diagnostics,
    values: impl FnOnce(&v1::SnowDiagnostics) -> Vec<f64>,
) -> Option<Vec<f64>> {
    diagnostics.snow.as_ref().map(values)
}

/// The bound that binds, followed from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct BoundLog {
    last: Option<v1::TimeBound>,
}

impl BoundLog {
    /// Logs the bound at the stream's current time, if it is another than before.
    pub(crate) fn log(
        &mut self,
        stream: &RecordingStream,
        diagnostics: &v1::Diagnostics,
    ) -> Result<(), RerunError> {
        let Some(snow) = &diagnostics.snow else { return Ok(()) };
        if self.last == Some(snow.bound()) {
            return Ok(());
        }
        self.last = Some(snow.bound());
        let state = StateChange::single(snow.bound().word());
        stream.log(BOUND_STATE, &state).map_err(refused(BOUND_STATE))?;
        let line = TextLog::new(sentence(snow)).with_level(TextLogLevel::INFO);
        stream.log(BOUND_LOG, &line).map_err(refused(BOUND_LOG))
    }
}

/// What binds, where, and how long a step may be.
fn sentence(snow: &v1::SnowDiagnostics) -> String {
    let name = snow.bound().word();
    let at = snow.bound_particle.map_or_else(String::new, |particle| format!(" at particle {particle}"));
    let length = if snow.bound_seconds.is_finite() {
        format!("{:.3e} s at most", snow.bound_seconds)
    } else {
        "no limit".to_owned()
    };
    format!("{name}{at}: {length}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_is_told_with_its_particle_and_its_length() {
        let mut snow = v1::SnowDiagnostics { bound_seconds: 2.5e-4, ..v1::SnowDiagnostics::default() };
        snow.set_bound(v1::TimeBound::Frame);
        assert_eq!(sentence(&snow), "frame: 2.500e-4 s at most");
        snow.set_bound(v1::TimeBound::ElasticWave);
        snow.bound_particle = Some(17);
        snow.bound_seconds = f64::INFINITY;
        assert_eq!(sentence(&snow), "elastic_wave at particle 17: no limit");
    }

    #[test]
    fn every_series_has_a_value_and_the_stages_are_found_by_name() {
        let stage = |stage: &str, seconds| v1::StageTime { stage: stage.to_owned(), seconds };
        let stages = vec![stage("sort", 0.5), stage("grid_to_particles", 0.25), stage("of_tomorrow", 9.0)];
        let snow = Some(v1::SnowDiagnostics::default());
        let diagnostics = v1::Diagnostics { stages, snow, ..v1::Diagnostics::default() };
        for plot in &SNOW {
            let values = (plot.values)(&diagnostics).expect("diagnostics of snow");
            assert_eq!(values.len(), plot.series.len(), "{}", plot.path);
            assert_eq!((plot.values)(&v1::Diagnostics::default()), None, "{}", plot.path);
        }
        assert_eq!((SNOW[7].values)(&diagnostics), Some(vec![500.0, 0.0, 0.0, 0.0, 250.0, 0.0]));
    }
}
