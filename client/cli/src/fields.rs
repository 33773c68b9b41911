//! What frames hold besides positions, as the command line says: arrays, nodes of the snow's grid, and the
//! colour that shows one of them.
//!
//! Enters: options of `run`, `mecasim`, the demo, `watch` and `view`. Leaves: watch options of the client.

use std::path::Path;

use clap::{Args, ValueEnum};
use nappe_client::{Field, GridOptions, WatchOptions, holds_snow, v1};

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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
pub(crate) enum ColorName {
    /// Plastic ratio J_P: white as it fell, blue where packed, amber where it came apart
    #[default]
    PlasticRatio,
    /// Speed, up to the largest so far
    Speed,
    /// Norm of the stress, by its logarithm
    Stress,
    /// One colour per body
    Body,
}

impl ColorName {
    /// The array that it needs.
    const fn field(self) -> Option<Field> {
        match self {
            Self::PlasticRatio => Some(Field::PlasticRatios),
            Self::Speed => Some(Field::Velocities),
            Self::Stress => Some(Field::StressNorms),
            Self::Body => None,
        }
    }
}

impl From<FieldName> for ColorName {
    fn from(name: FieldName) -> Self {
        match name {
            FieldName::Velocity => Self::Speed,
            FieldName::PlasticRatio => Self::PlasticRatio,
            FieldName::Stress => Self::Stress,
        }
    }
}

#[cfg(feature = "rerun")]
impl From<ColorName> for nappe_rerun::ColorBy {
    fn from(name: ColorName) -> Self {
        match name {
            ColorName::PlasticRatio => Self::PlasticRatio,
            ColorName::Speed => Self::Speed,
            ColorName::Stress => Self::Stress,
            ColorName::Body => Self::Body,
        }
    }
}

impl ShownArgs {
    /// Nodes of the grid that were asked for.
    pub(crate) fn grid(&self) -> Option<GridOptions> {
        self.grid.map(|grid| GridOptions { max_nodes: self.grid_nodes.unwrap_or(grid.max_nodes), ..grid })
    }

    /// The colour asked for.
    #[cfg(feature = "rerun")]
    pub(crate) fn color(&self) -> Option<ColorName> {
        self.color
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

    /// The colour of a recording.
    pub(crate) fn recording_color(&self) -> ColorName {
        let first = self.fields.first().copied().map(ColorName::from);
        self.shown.color.or(first).unwrap_or_default()
    }

    /// These watch options with what is kept, of frames of `session` that go to `save`.
    pub(crate) fn watch(
        &self,
        mut options: WatchOptions,
        session: &v1::Session,
        save: &Path,
    ) -> WatchOptions {
        options.fields = self.fields.iter().copied().map(Field::from).collect();
        let is_asked = self.shown.color.is_some() || holds_snow(session);
        if let Some(field) = self.recording_color().field()
            && paths::is_recording(save)
            && is_asked
        {
            options.fields = options.fields.with(field);
        }
        options.grid = self.shown.grid();
        options
    }
}

#[cfg(test)]
mod tests {
    use nappe_client::Fields;

    use super::*;

    #[test]
    fn a_recording_asks_for_what_its_colour_shows_and_a_folder_for_what_was_named() {
        let cloth = v1::Session { particle_count: 9, spring_count: 9, ..v1::Session::default() };
        let snow = v1::Session { particle_count: 12, snow_particle_count: 3, ..cloth.clone() };
        let fields = |args: &FieldsArgs, session: &v1::Session, path: &str| {
            args.watch(WatchOptions::default(), session, Path::new(path)).fields
        };
        let plain = FieldsArgs::default();
        assert_eq!(fields(&plain, &snow, "a.rrd"), Fields::positions().with(Field::PlasticRatios));
        assert_eq!(fields(&plain, &cloth, "a.rrd"), Fields::positions());
        assert_eq!(fields(&plain, &snow, "folder"), Fields::positions());
        let stress = FieldsArgs { fields: vec![FieldName::Stress], ..plain };
        assert_eq!(fields(&stress, &cloth, "folder"), Fields::positions().with(Field::StressNorms));
        assert_eq!(stress.recording_color(), ColorName::Stress);
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
