//! Diagnostics of a step to time series.
//!
//! Enters: `v1::Diagnostics`. Leaves: one row of scalars for each [`Plot`], named and coloured once. What snow
//! adds stands in `snow_plots`.

use nappe_client::v1;

use crate::{
    error::{RerunError, refused},
    sdk::{Color, RecordingStream, Scalars, SeriesLines},
};

/// A plot: its entity path, its title with unit, its series and where their values come from.
pub(crate) struct Plot {
    pub(crate) path: &'static str,
    pub(crate) title: &'static str,
    pub(crate) series: &'static [Series],
    pub(crate) values: fn(&v1::Diagnostics) -> Option<Vec<f64>>,
}

impl Plot {
    /// True if a legend is needed.
    pub(crate) fn has_several_series(&self) -> bool {
        self.series.len() > 1
    }
}

pub(crate) const BLUE: [u8; 3] = [86, 156, 230];
pub(crate) const RED: [u8; 3] = [232, 93, 79];
pub(crate) const GREEN: [u8; 3] = [110, 190, 120];
pub(crate) const LIGHT: [u8; 3] = [225, 225, 225];
pub(crate) const AMBER: [u8; 3] = [240, 180, 70];
pub(crate) const TEAL: [u8; 3] = [70, 190, 190];
pub(crate) const VIOLET: [u8; 3] = [170, 120, 210];
pub(crate) const BROWN: [u8; 3] = [170, 130, 100];

/// A series: its name and colour.
pub(crate) type Series = (&'static str, [u8; 3]);

const STAGES: &[Series] = &[("force", RED), ("solve", BLUE), ("position", TEAL), ("collide", BROWN)];

/// Plots of any scene, from top to bottom.
pub(crate) const GENERAL: [Plot; 4] = [
    Plot {
        path: "plots/energy",
        title: "Energy (J)",
        series: &[("kinetic", RED), ("elastic", BLUE), ("gravitational", GREEN), ("total", LIGHT)],
        values: |d| {
            let parts = [d.kinetic_energy, d.elastic_energy, d.gravitational_energy];
            Some(vec![parts[0], parts[1], parts[2], parts.iter().sum()])
        },
    },
    Plot {
        path: "plots/momentum",
        title: "Momentum (kg m/s)",
        series: &[("x", RED), ("y", GREEN), ("z", BLUE)],
        values: |d| d.momentum.as_ref().map(|momentum| vec![momentum.x, momentum.y, momentum.z]),
    },
    Plot {
        path: "plots/contacts",
        title: "Contacts",
        series: &[("contacts", GREEN)],
        values: |d| Some(vec![d.contact_count as f64]),
    },
    Plot {
        path: "plots/step_time",
        title: "Time of a step (ms)",
        series: &[("step", AMBER)],
        values: |d| Some(vec![d.step_seconds * 1e3]),
    },
];

/// Plots of scenes with cloth.
pub(crate) const CLOTH: [Plot; 7] = [
    Plot {
        path: "plots/stretch",
        title: "Largest stretch (1)",
        series: &[("max stretch", AMBER)],
        values: |d| Some(vec![d.max_stretch]),
    },
    Plot {
        path: "plots/iterations",
        title: "Solver iterations",
        series: &[("iterations", BLUE)],
        values: |d| d.solve.as_ref().map(|solve| vec![f64::from(solve.iterations)]),
    },
    Plot {
        path: "plots/residual",
        title: "Solver residual (log10)",
        series: &[("log10 residual", RED)],
        // An exact solution has no logarithm, and no point.
        values: |d| {
            let residual = d.solve.as_ref()?.relative_residual;
            (residual > 0.0 && residual.is_finite()).then(|| vec![residual.log10()])
        },
    },
    Plot {
        path: "plots/cloth_dt",
        title: "Sub-step of the cloth (ms)",
        series: &[("dt", LIGHT), ("bound", RED)],
        values: |d| d.cloth.as_ref().map(|cloth| vec![1e3 * cloth.dt_seconds, 1e3 * cloth.bound_seconds]),
    },
    Plot {
        path: "plots/cloth_error",
        title: "Estimated error of a sub-step (log10 m)",
        series: &[("root mean square", BLUE), ("largest", RED)],
        // Nothing that moves has no error, no logarithm, and no point.
        values: |d| {
            let cloth = d.cloth.as_ref().filter(|cloth| cloth.error_rms > 0.0)?;
            Some(vec![cloth.error_rms.log10(), cloth.error_largest.log10()])
        },
    },
    Plot {
        path: "plots/notices",
        title: "Doubtful solves, passages, steps taken again, pinched and torn particles, yielding corners",
        series: &[
            ("at their cap", AMBER),
            ("not positive definite", RED),
            ("through a collider", BLUE),
            ("taken again", GREEN),
            ("pinched", LIGHT),
            ("yielding", VIOLET),
            ("torn", TEAL),
        ],
        values: |d| {
            let v1::Notices {
                capped_solves,
                indefinite_solves,
                passed_particles,
                rejected_steps,
                pinched_particles,
                yielding_corners,
                torn_particles,
                ..
            } = d.notices?;
            let counts = [
                capped_solves,
                indefinite_solves,
                passed_particles,
                rejected_steps,
                pinched_particles,
                yielding_corners,
                torn_particles,
            ];
            Some(counts.map(|count| count as f64).to_vec())
        },
    },
    Plot {
        path: "plots/stages",
        title: "Time of stages (ms)",
        series: STAGES,
        values: |d| stage_times(d, STAGES),
    },
];

/// Milliseconds of the stages that these series name; none if the step was not timed.
pub(crate) fn stage_times(diagnostics: &v1::Diagnostics, series: &[Series]) -> Option<Vec<f64>> {
    if diagnostics.stages.is_empty() {
        return None;
    }
    let milliseconds = |name: &str| {
        let times = diagnostics.stages.iter().filter(|time| time.stage == name);
        1e3 * times.map(|time| time.seconds).sum::<f64>()
    };
    Some(series.iter().map(|(name, _)| milliseconds(name)).collect())
}

/// Logs names and colours of all series of these plots, once.
pub(crate) fn describe(stream: &RecordingStream, plots: &[Plot]) -> Result<(), RerunError> {
    for plot in plots {
        let names = plot.series.iter().map(|(name, _)| *name);
        let colors = plot.series.iter().map(|&(_, [red, green, blue])| Color::from_rgb(red, green, blue));
        let lines = SeriesLines::new().with_names(names).with_colors(colors);
        stream.log_static(plot.path, &lines).map_err(refused(plot.path))?;
    }
    Ok(())
}

/// Logs the diagnostics of a step at the stream's current time. Values that are not finite leave a gap.
pub(crate) fn log(
    stream: &RecordingStream,
    diagnostics: &v1::Diagnostics,
    plots: &[Plot],
) -> Result<(), RerunError> {
    for plot in plots {
        let Some(values) = (plot.values)(diagnostics) else { continue };
        if values.iter().all(|value| value.is_finite()) {
            stream.log(plot.path, &Scalars::new(values)).map_err(refused(plot.path))?;
        }
    }
    Ok(())
}
