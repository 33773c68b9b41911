//! What frames hold besides positions, as the command line says: arrays, nodes of the snow's grid, and the
//! colour that shows one of them.
//!
//! Enters: options of `run`, `mecasim`, the demo, `watch` and `view`. Leaves: watch options of the client, or options of
//! a viewer.

use std::{ffi::OsString, path::Path};

use clap::{Args, ValueEnum};
use nappe_client::{Encoding, Field, GridOptions, WatchOptions, packed::Step, v1};
use nappe_server::numbers::{Least, METRES, real, whole};

use crate::{
    files::paths,
    words::error::{CliError, Result},
};

/// What is kept of each frame besides positions.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct FieldsArgs {
    /// Keep these arrays as well; a recording shows the first as colour, forces and accelerations as arrows
    #[arg(long, value_enum, value_name = "ARRAY,...", value_delimiter = ',')]
    fields: Vec<FieldName>,
    /// How far a coordinate in an HTML file may be from what it was (m) [default: the extent of the first frame over
    /// 16384]
    #[arg(long, value_name = "METRES", value_parser = real(METRES, Least::Above0))]
    max_error: Option<f64>,
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
    #[arg(long, value_name = "N", requires = "grid", value_parser = whole::<u32>(1..))]
    grid_nodes: Option<u32>,
    /// What the colour of snow shows, in Rerun and on pages [default: plastic_ratio]
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
    /// What acts on each particle (N), contacts left out; of a pin what it holds
    Force,
    /// The same over the mass of each particle (m/s²); 0 for pins
    Acceleration,
}

impl From<FieldName> for Field {
    fn from(name: FieldName) -> Self {
        match name {
            FieldName::Velocity => Self::Velocities,
            FieldName::PlasticRatio => Self::PlasticRatios,
            FieldName::Stress => Self::StressNorms,
            FieldName::Force => Self::Forces,
            FieldName::Acceleration => Self::Accelerations,
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

impl ColorName {
    /// The array that it needs.
    pub(crate) const fn field(self) -> Option<Field> {
        match self {
            Self::PlasticRatio => Some(Field::PlasticRatios),
            Self::Speed => Some(Field::Velocities),
            Self::Stress => Some(Field::StressNorms),
            Self::Body => None,
        }
    }

    /// Its name, where it shows numbers of particles.
    pub(crate) const fn shown(self) -> Option<&'static str> {
        match self {
            Self::PlasticRatio => Some("plastic_ratio"),
            Self::Speed => Some("speed"),
            Self::Stress => Some("stress"),
            Self::Body => None,
        }
    }
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
    /// When nothing is kept, or what is asked for cannot be kept there.
    pub(crate) fn check(&self, save: Option<&Path>) -> Result<()> {
        let [fields, grid, color, error] = [
            ("--fields", !self.fields.is_empty()),
            ("--grid", self.shown.grid.is_some()),
            ("--color", self.shown.color.is_some()),
            ("--max-error", self.max_error.is_some()),
        ]
        .map(|(option, is_asked)| is_asked.then_some(option));
        if self.max_error.is_some_and(|error| Step::within(error).is_none()) {
            return Err(CliError::usage("--max-error is a number above 0 (m)"));
        }
        let Some(path) = save else {
            let Some(option) = fields.or(grid).or(color).or(error) else { return Ok(()) };
            return Err(CliError::usage(format!(
                "{option} says what to keep: --save says where, and is missing"
            ))
            .hint("--save FILE.html keeps a page, FILE.rrd a Rerun recording, FILE.pvd files for ParaView, FILE.usda a scene of USD, FOLDER PLY files; FILE.png is a picture, FILE.mp4 a film"));
        };
        let grid = grid.map(|option| {
            (option, "a Rerun recording, to a .pvd of files for ParaView, or to a folder of PLY files")
        });
        let array = fields.map(|option| {
            (option, "a Rerun recording, to a .pvd of files for ParaView, to a .usda of a scene, or to a folder of PLY files")
        });
        let array = array.or(grid);
        let color = color.map(|option| (option, "an HTML file, a picture, a film, or to a Rerun recording"));
        let error = error.map(|option| (option, "an HTML file, a picture or a film"));
        let wrong = if paths::is_html(path) || paths::is_drawn(path) {
            array
        } else if paths::is_recording(path) {
            error
        } else if paths::is_table(path) {
            array.or(color).or(error)
        } else if paths::is_usd(path) {
            grid.or(color).or(error)
        } else {
            color.or(error)
        };
        match wrong {
            Some((option, place)) => {
                Err(CliError::usage(format!("{option} belongs to {place}, and {} is none", path.display())))
            }
            None => Ok(()),
        }
    }

    /// Whether velocities are kept.
    pub(crate) fn keep_velocities(&self) -> bool {
        self.fields.contains(&FieldName::Velocity)
    }

    /// The same with every array that a saved frame has, by the names of its numbers.
    pub(crate) fn as_saved(&self, properties: &[String]) -> Self {
        let mut kept = self.clone();
        let arrays = [
            ("vx", FieldName::Velocity),
            ("plastic_ratio", FieldName::PlasticRatio),
            ("stress_norm", FieldName::Stress),
            ("fx", FieldName::Force),
            ("ax", FieldName::Acceleration),
        ];
        for (name, field) in arrays {
            if properties.iter().any(|property| property == name) && !kept.fields.contains(&field) {
                kept.fields.push(field);
            }
        }
        kept
    }

    /// The colour asked for.
    pub(crate) fn color(&self) -> Option<ColorName> {
        self.shown.color
    }

    /// How far a coordinate may be from what it was (m), if that was said.
    pub(crate) fn max_error(&self) -> Option<f64> {
        self.max_error
    }

    /// These watch options with what is kept.
    pub(crate) fn watch(&self, mut options: WatchOptions) -> WatchOptions {
        options.fields = self.fields.iter().copied().map(Field::from).collect();
        let force = self.fields.contains(&FieldName::Force);
        options.grid = self.shown.grid().map(|grid| GridOptions { force, ..grid });
        options
    }

    /// These watch options with what is kept, in the precision of a session.
    pub(crate) fn watch_exactly(&self, options: WatchOptions, session: &v1::Session) -> WatchOptions {
        let encoding = match session.precision() {
            v1::Precision::F64 => Encoding::F64,
            v1::Precision::F32 | v1::Precision::Unspecified => Encoding::F32,
        };
        WatchOptions { encoding, ..self.watch(options) }
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
        let fields = vec![FieldName::Stress, FieldName::PlasticRatio];
        let args = FieldsArgs { fields, shown, max_error: None };
        let watched = args.watch(WatchOptions::default());
        assert!(watched.fields.contains(Field::StressNorms) && !watched.fields.contains(Field::Velocities));
        assert_eq!(watched.grid.map(|grid| grid.max_nodes), Some(9));
        assert_eq!(
            args.viewer_options(),
            ["--color=speed", "--grid=slice:y=-0.25", "--grid-nodes=9", "--fields=stress,plastic_ratio"]
        );
        let saved = args.as_saved(&["x", "vx", "vy", "vz", "stress_norm"].map(str::to_owned));
        assert!(saved.keep_velocities() && !args.keep_velocities());
        assert_eq!(saved.viewer_options().last(), Some(&"--fields=stress,plastic_ratio,velocity".into()));
        let acting = ["x", "fx", "fy", "fz", "ax", "ay", "az"].map(str::to_owned);
        let acting = FieldsArgs::default().as_saved(&acting);
        assert_eq!(acting.viewer_options(), ["--fields=force,acceleration"]);
        let shown = ShownArgs { grid: Some(GridOptions::all()), ..ShownArgs::default() };
        let nodes = FieldsArgs { shown: shown.clone(), ..acting }.watch(WatchOptions::default()).grid;
        assert_eq!(nodes, Some(GridOptions { force: true, ..GridOptions::all() }));
        let plain = FieldsArgs { shown, ..FieldsArgs::default() }.watch(WatchOptions::default()).grid;
        assert_eq!(plain, Some(GridOptions::all()));
    }

    #[test]
    fn what_is_kept_needs_a_place_that_can_hold_it() {
        let smoke = ShownArgs { grid: Some(GridOptions::all()), ..ShownArgs::default() };
        let smoke = FieldsArgs { shown: smoke, ..FieldsArgs::default() };
        let color = ShownArgs { color: Some(ColorName::Speed), ..ShownArgs::default() };
        let color = FieldsArgs { shown: color, ..FieldsArgs::default() };
        let error = FieldsArgs { max_error: Some(1e-3), ..FieldsArgs::default() };
        let fields = FieldsArgs { fields: vec![FieldName::Velocity], ..FieldsArgs::default() };
        let places = |args: &FieldsArgs| {
            [
                None,
                Some("folder"),
                Some("a.rrd"),
                Some("a.html"),
                Some("a.pvd"),
                Some("a.csv"),
                Some("a.usda"),
                Some("a.png"),
            ]
            .map(|path| args.check(path.map(Path::new)).is_ok())
        };
        assert_eq!(places(&smoke), [false, true, true, false, true, false, false, false]);
        assert_eq!(places(&fields), [false, true, true, false, true, false, true, false]);
        assert_eq!(places(&color), [false, false, true, true, false, false, false, true]);
        assert_eq!(places(&error), [false, false, false, true, false, false, false, true]);
        assert_eq!(places(&FieldsArgs::default()), [true; 8]);
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let wrong = FieldsArgs { max_error: Some(wrong), ..FieldsArgs::default() };
            assert_eq!(places(&wrong), [false; 8]);
        }
    }
}
