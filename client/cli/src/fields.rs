//! What frames hold besides positions, as the command line says: arrays, nodes of the snow's grid, and the
//! colour that shows one of them.
//!
//! Enters: options of `run`, `mecasim`, the demo, `watch` and `view`. Leaves: watch options of the client, or options of
//! a viewer.

use std::{ffi::OsString, path::Path};

use clap::{Args, ValueEnum};
use nappe_client::{Field, GridOptions, WatchOptions};

use crate::{
    error::{CliError, Result},
    paths,
};

/// What is kept of each frame besides positions.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct FieldsArgs {
    /// Keep these arrays as well; a recording shows the first as colour
    #[arg(long, value_enum, value_name = "ARRAY,...", value_delimiter = ',')]
    fields: Vec<FieldName>,
    #[command(flatten)]
    shown: ShownArgs,
}

/// What a Rerun view shows besides positions.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct ShownArgs {
    /// Keep nodes of the snow's grid: its mass as smoke, or the velocities on the plane of nodes nearest to a
    /// coordinate (m)
    #[arg(long, value_name = "smoke|slice:AXIS=METRES")]
    grid: Option<GridOptions>,
    /// Most nodes of the grid per frame; of more, every second, third ... along each axis is kept [default: as
    /// many as the server allows]
    #[arg(long, value_name = "N", requires = "grid", value_parser = clap::value_parser!(u32).range(1..))]
    grid_nodes: Option<u32>,
    /// What the colour of snow shows in Rerun [default: plastic_ratio]
    #[arg(long, value_enum)]
    color: Option<ColorName>,
}

/// An array on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
pub(crate) enum FieldName {
    /// Velocities (m/s)
    Velocity,
    /// Plastic ratio J_P of snow, below 1 where it is packed; 1 for cloth
    PlasticRatio,
    /// Frobenius norm of the Cauchy stress of snow (Pa); 0 for cloth
    Stress,
}

impl From<FieldName> for Field {
    fn from(name: FieldName) -> Self {
        match name {
            FieldName::Velocity => Self::Velocities,
            FieldName::PlasticRatio => Self::PlasticRatios,
            FieldName::Stress => Self::StressNorms,
        }
    }
}

/// What a colour shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
pub(crate) enum ColorName {
    /// Plastic ratio J_P: white as it fell, blue where packed, amber where it came apart
    PlasticRatio,
    /// Speed, up to the largest so far
    Speed,
    /// Norm of the stress, by its logarithm
    Stress,
    /// One colour per body
    Body,
}

impl ShownArgs {
    /// Nodes of the grid that were asked for.
    pub(crate) fn grid(&self) -> Option<GridOptions> {
        self.grid.map(|grid| GridOptions { max_nodes: self.grid_nodes.unwrap_or(grid.max_nodes), ..grid })
    }

    /// The same, as options of a viewer.
    pub(crate) fn viewer_options(&self) -> Vec<OsString> {
        let color = self.color.as_ref().and_then(ValueEnum::to_possible_value);
        let words = [
            color.map(|color| format!("--color={}", color.get_name())),
            self.grid.map(|grid| format!("--grid={grid}")),
            self.grid_nodes.map(|nodes| format!("--grid-nodes={nodes}")),
        ];
        words.into_iter().flatten().map(OsString::from).collect()
    }
}

impl FieldsArgs {
    /// Checks the choices against where the frames go.
    ///
    /// # Errors
    /// When nothing is kept, or a colour is asked for where there is none.
    pub(crate) fn check(&self, save: Option<&Path>) -> Result<()> {
        let asked = [
            ("--fields", !self.fields.is_empty()),
            ("--grid", self.shown.grid.is_some()),
            ("--color", self.shown.color.is_some()),
        ];
        let first = asked.iter().find(|(_, is_asked)| *is_asked);
        match (first, save) {
            (Some((option, _)), None) => {
                Err(CliError::usage(format!("{option} says what to keep: --save says where, and is missing"))
                    .hint("--save FILE.rrd keeps a Rerun recording, --save FOLDER PLY files"))
            }
            (Some(_), Some(path)) if self.shown.color.is_some() && !paths::is_recording(path) => {
                Err(CliError::usage(format!(
                    "--color belongs to a Rerun recording, and {} is none",
                    path.display()
                ))
                .hint("--fields keeps the arrays themselves in PLY files"))
            }
            _ => Ok(()),
        }
    }

    /// These watch options with what is kept.
    pub(crate) fn watch(&self, mut options: WatchOptions) -> WatchOptions {
        options.fields = self.fields.iter().copied().map(Field::from).collect();
        options.grid = self.shown.grid();
        options
    }

    /// What is kept, as options of a viewer.
    pub(crate) fn viewer_options(&self) -> Vec<OsString> {
        let names: Vec<&str> = self.fields.iter().map(|&name| Field::from(name).option()).collect();
        let mut options = self.shown.viewer_options();
        if !names.is_empty() {
            options.push(format!("--fields={}", names.join(",")).into());
        }
        options
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_watched_for_a_folder_and_told_to_a_viewer() {
        let plain = FieldsArgs::default();
        assert!(plain.viewer_options().is_empty());
        let grid = Some("slice:y=-0.25".parse().expect("a slice"));
        let shown = ShownArgs { grid, grid_nodes: Some(9), color: Some(ColorName::Speed) };
        let args = FieldsArgs { fields: vec![FieldName::Stress, FieldName::PlasticRatio], shown };
        let watched = args.watch(WatchOptions::default());
        assert!(watched.fields.contains(Field::StressNorms) && !watched.fields.contains(Field::Velocities));
        assert_eq!(watched.grid.map(|grid| grid.max_nodes), Some(9));
        assert_eq!(
            args.viewer_options(),
            ["--color=speed", "--grid=slice:y=-0.25", "--grid-nodes=9", "--fields=stress,plastic_ratio"]
        );
    }

    #[test]
    fn what_is_kept_needs_a_place_and_a_colour_a_recording() {
        let smoke = ShownArgs { grid: Some(GridOptions::all()), ..ShownArgs::default() };
        let args = FieldsArgs { fields: Vec::new(), shown: smoke };
        assert!(args.check(None).is_err() && args.check(Some(Path::new("folder"))).is_ok());
        let color = ShownArgs { color: Some(ColorName::Speed), ..ShownArgs::default() };
        let args = FieldsArgs { fields: Vec::new(), shown: color };
        assert!(
            args.check(Some(Path::new("folder"))).is_err() && args.check(Some(Path::new("a.rrd"))).is_ok()
        );
        assert!(FieldsArgs::default().check(None).is_ok());
    }
}
