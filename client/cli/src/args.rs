//! The command line: verbs, and the options that several of them share.
//!
//! Enters: what was typed. Leaves: typed values; each verb's own options stand in its file.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use nappe_sim::math::Precision;

use crate::{bench::BenchArgs, contents::ContentsArgs, output::OutputArgs, verbs};

/// Where a server listens unless told otherwise.
pub(crate) const DEFAULT_SERVER: &str = "http://127.0.0.1:6277";

const EXAMPLES: &str = "\
Examples:
  nappe                                   see a cloth fall over a sphere: the demo, in one command
  nappe scenes                            the scenes that come with nappe
  nappe run flag --save flag.rrd          compute a shipped scene, keep a Rerun recording
  nappe run my.toml --steps 100 --json    compute a scene file, end with one JSON object
  nappe serve                             a server for other programs and machines' clients
  nappe create demo --id first            a session on that server
  nappe play first && nappe watch first   let it run, see its figures
  nappe bench zara                        the table of Zara 2001 on this machine
  nappe bench snow                        particle-steps a second of snow

`nappe VERB --help` says more about a verb.";

const EXIT_CODES: &str = "\
Exit codes:
    0  done
    1  failed: a file, a scene, a mesh
    2  the command line is wrong
    3  the simulation diverged (with --json the result is printed all the same)
    4  no server answers at the address
    5  the server refused: the message ends with its reason, a word in capitals
  130  ended by Ctrl-C or SIGTERM

Environment:
  NAPPE_SERVER  address of the server for the verbs that talk to one";

/// Cloth and snow, computed on a server and watched from elsewhere.
///
/// Without a verb, nappe runs a demonstration: a server inside this command, a client that talks to
/// it through gRPC, and a recording to look at. It ends by itself and needs no screen.
#[derive(Parser, Debug)]
#[command(name = "nappe", version, after_help = EXAMPLES, after_long_help = format!("{EXAMPLES}\n\n{EXIT_CODES}"),
          args_conflicts_with_subcommands = true, max_term_width = 110)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) verb: Option<Verb>,
    #[command(flatten)]
    pub(crate) demo: verbs::demo::DemoArgs,
}

/// What nappe can do.
#[derive(Subcommand, Debug)]
pub(crate) enum Verb {
    /// Show what nappe does: the same as `nappe` alone
    Demo(verbs::demo::DemoArgs),
    /// Compute a scene from its start to its end
    Run(verbs::run::RunArgs),
    /// Compute the objects of the MecaSim course from its own files
    Mecasim(verbs::mecasim::MecasimArgs),
    /// List the scenes that come with nappe
    Scenes(verbs::scenes::ScenesArgs),
    /// Make, convert and describe meshes
    Mesh(verbs::mesh::MeshArgs),
    /// Run a server until Ctrl-C
    Serve(verbs::serve::ServeArgs),
    /// Make a session on a server
    Create(verbs::create::CreateArgs),
    /// List the sessions of a server
    List(verbs::list::ListArgs),
    /// Let a session step on
    Play(verbs::play::PlayArgs),
    /// Stop a session's stepping for a while
    Pause(SessionArgs),
    /// Take a number of steps
    Step(verbs::step::StepArgs),
    /// Change gravity, wind, springs or pins of a session
    Update(verbs::update::UpdateArgs),
    /// Follow a session's figures, or save its frames
    Watch(verbs::watch::WatchArgs),
    /// Show a session in Rerun
    View(verbs::view::ViewArgs),
    /// End a session's simulation; it stays readable
    Stop(SessionArgs),
    /// Forget a session
    Delete(SessionArgs),
    /// Measure what this machine does
    Bench(BenchArgs),
    /// Print the completion script of a shell
    Completions(verbs::completions::CompletionsArgs),
}

/// Which server.
#[derive(Args, Clone, Debug)]
pub(crate) struct ServerArgs {
    /// Address of the server
    #[arg(long, env = "NAPPE_SERVER", value_name = "URL", default_value = DEFAULT_SERVER)]
    pub(crate) server: String,
}

/// A session, for the verbs that need nothing else.
#[derive(Args, Clone, Debug)]
pub(crate) struct SessionArgs {
    /// Id of the session, as `nappe list` shows it
    pub(crate) session: String,
    #[command(flatten)]
    pub(crate) server: ServerArgs,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// How a whole simulation is computed and kept: `run`, `mecasim` and the demo.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct ComputeArgs {
    /// Steps to take [default: as the scene says]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) steps: Option<u64>,
    /// Threads [default: all cores]; results do not depend on them
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) threads: Option<u32>,
    /// Precision of positions and velocities [default: as the scene says]
    #[arg(long, value_enum)]
    pub(crate) precision: Option<PrecisionName>,
    /// A frame every so many steps [default: as the scene says]
    #[arg(long, value_name = "STEPS", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) frame_every: Option<u32>,
    /// Keep the frames: a Rerun recording FILE.rrd, or a folder of PLY files
    #[arg(long, value_name = "FILE.rrd|FOLDER")]
    pub(crate) save: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) contents: ContentsArgs,
}

/// A precision on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PrecisionName {
    /// IEEE binary32
    F32,
    /// IEEE binary64
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

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    #[test]
    fn the_command_line_holds_together() {
        Cli::command().debug_assert();
    }
}
