//! Groups of options that several verbs share.
//!
//! Enters: what was typed. Leaves: typed values. Options of one verb stand in the verb's file.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use nappe_client::{CreateSession, Scene};
use nappe_server::{
    RankSettings,
    numbers::{Least, SECONDS, real, whole},
};
use nappe_sim::math::Precision;

use crate::{
    files::write::ForceArgs,
    options::{fields::FieldsArgs, picture_args::PictureArgs},
    words::output::OutputArgs,
};

/// Where a server listens unless told otherwise.
const DEFAULT_SERVER: &str = "http://127.0.0.1:6277";

/// The server that a verb talks to.
#[derive(Args, Clone, Debug)]
pub(crate) struct ServerArgs {
    /// Address of the server: HOST:PORT, http://HOST:PORT or unix:PATH
    #[arg(long, env = "NAPPE_SERVER", value_name = "URL", default_value = DEFAULT_SERVER)]
    pub(crate) server: String,
    #[command(flatten)]
    pub(crate) token: TokenArgs,
}

/// What is shown to a server.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct TokenArgs {
    /// File with the token of the server [default: found, if the server is yours and on this machine]
    #[arg(long = "token", env = "NAPPE_TOKEN_FILE", value_name = "FILE")]
    pub(crate) file: Option<PathBuf>,
}

/// A server instead of the one inside this command.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct OtherServerArgs {
    /// Compute on the server at this address instead of in this command
    #[arg(long, value_name = "URL")]
    pub(crate) server: Option<String>,
    #[command(flatten)]
    pub(crate) token: TokenArgs,
}

/// Which session, on which server, and who reads the answer.
#[derive(Args, Clone, Debug)]
pub(crate) struct SessionArgs {
    /// Id of the session, as `nappe list` shows it
    #[arg(value_name = "SESSION")]
    pub(crate) id: String,
    #[command(flatten)]
    pub(crate) server: ServerArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// What a session takes from the command line instead of its scene.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct OverrideArgs {
    /// Steps until the session ends, from the start of the scene; 0: never [default: as the scene says]
    #[arg(long, value_name = "N", value_parser = whole::<u64>(0..))]
    steps: Option<u64>,
    /// Threads [default: all cores of the server]; results do not depend on them
    #[arg(long, value_name = "T", value_parser = whole::<u32>(1..))]
    threads: Option<u32>,
    /// Precision of positions and velocities [default: as the scene says]
    #[arg(long, value_enum)]
    precision: Option<PrecisionName>,
    /// Steps between frames [default: as the scene says]
    #[arg(long, alias = "frame-every", value_name = "STEPS", value_parser = whole::<u32>(1..))]
    frame_interval: Option<u32>,
    /// Ranks of a cluster that step it, with --threads each [default: none, the server steps it]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..))]
    ranks: Option<u32>,
}

impl OverrideArgs {
    /// Those of a session that never ends by itself, whatever its scene says.
    pub(crate) fn endless() -> Self {
        Self { steps: Some(0), ..Self::default() }
    }

    /// Steps until the session ends (0: never), if they are asked for.
    pub(crate) fn step_limit(&self) -> Option<u64> {
        self.steps
    }

    /// What of these options the states of a run depend on, as a text: neither threads nor ranks.
    pub(crate) fn of_states(&self) -> String {
        format!("{:?} {:?} {:?}", self.steps, self.precision, self.frame_interval)
    }

    /// The same in this precision, unless one is asked for.
    pub(crate) fn or_in(&self, precision: Option<nappe_client::Precision>) -> Self {
        let precision = precision.map(|precision| match precision {
            nappe_client::Precision::F32 => PrecisionName::F32,
            nappe_client::Precision::F64 => PrecisionName::F64,
        });
        Self { precision: self.precision.or(precision), ..self.clone() }
    }

    /// The session to create from a scene; with an empty id, the server chooses one.
    pub(crate) fn session(&self, session_id: String, scene: Scene) -> CreateSession {
        CreateSession {
            session_id,
            scene,
            precision: self.precision.map(Into::into),
            thread_count: self.threads.unwrap_or(0),
            step_limit: self.steps,
            frame_interval_steps: self.frame_interval.unwrap_or(0),
            rank_count: self.ranks.unwrap_or(0),
            begin: None,
        }
    }

    /// Puts into a scene what has a key there: steps, precision, steps between frames.
    pub(crate) fn put_into(&self, scene: &mut nappe_scene::Scene) {
        scene.steps = self.steps.unwrap_or(scene.steps);
        scene.frame_interval = self.frame_interval.unwrap_or(scene.frame_interval);
        scene.precision = self.precision.map_or(scene.precision, Into::into);
    }
}

/// How a whole simulation is computed and kept: `run`, `mecasim` and the demo.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct ComputeArgs {
    #[command(flatten)]
    pub(crate) overrides: OverrideArgs,
    /// Keep the frames: a page FILE.html, a Rerun recording FILE.rrd, files for ParaView FILE.pvd, a scene of USD FILE.usda, a table
    /// FILE.csv, or a folder of PLY files; or draw them: the last one, a picture FILE.png, or all, a film FILE.mp4
    #[arg(long, value_name = "FILE.html|FILE.rrd|FILE.pvd|FILE.usda|FILE.csv|FILE.png|FILE.mp4|FOLDER")]
    pub(crate) save: Option<PathBuf>,
    /// Keep a table too: a row per frame with what its step reported
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) table: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Do not tell on standard error how far it is: no bar on a terminal, no line every 10 s in a file or a pipe
    #[arg(long, help_heading = "Output")]
    pub(crate) quiet: bool,
    /// Begin at a frame that was saved of the same scene with --fields velocity, or at the last one of a folder: with its step
    /// and its time
    #[arg(long, value_name = "FILE.ply|FOLDER")]
    pub(crate) start: Option<PathBuf>,
    /// Go on in a folder of --save --fields velocity, from its last frame, as the run that was saved there
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["save", "table", "start", "force"])]
    pub(crate) resume: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) fields: FieldsArgs,
    #[command(flatten)]
    pub(crate) picture: PictureArgs,
    #[command(flatten, next_help_heading = "Ranks of the server in this command")]
    pub(crate) ranks: RankSettings,
}

/// Where a run is kept that goes on where it was cut off.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct JobArgs {
    /// Keep states of the run in this folder, so that the same command line goes on where it was cut off, also by a kill; --save
    /// names a folder of PLY files then
    #[arg(long, value_name = "DIR", conflicts_with_all = ["server", "table", "start", "resume"])]
    pub(crate) state_dir: Option<PathBuf>,
    /// Forget what --state-dir keeps of the run, and begin anew
    #[arg(long, requires = "state_dir")]
    pub(crate) fresh: bool,
    /// Seconds between two states that are kept [default: 10]; more where keeping them would take more than 2 % of the time
    #[arg(long, value_name = "SECONDS", requires = "state_dir", value_parser = real(SECONDS, Least::From0))]
    pub(crate) checkpoint_seconds: Option<f64>,
}

/// A precision on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PrecisionName {
    /// 32 bits, IEEE binary32
    F32,
    /// 64 bits, IEEE binary64
    F64,
}

impl From<PrecisionName> for Precision {
    fn from(name: PrecisionName) -> Self {
        match name {
            PrecisionName::F32 => Self::F32,
            PrecisionName::F64 => Self::F64,
        }
    }
}

impl From<PrecisionName> for nappe_client::Precision {
    fn from(name: PrecisionName) -> Self {
        match name {
            PrecisionName::F32 => Self::F32,
            PrecisionName::F64 => Self::F64,
        }
    }
}
