//! The `nappe` command: reads the command line, runs the verb, ends with an exit code.
//!
//! Results go to standard output, everything else to standard error. Modules in reading order:

mod error;
mod output;
mod version;
mod write;
mod aside;
mod paths;
mod diagnostics;
mod session;
mod fields;
mod args;
mod particles;
mod components;
mod collider_args;
mod pull_args;
mod remote;
mod web;
mod ssh;
mod meshes;
mod mesh_info;
mod scene;
mod scene_files;
mod frame_notes;
mod viewer;
mod study;
mod save;
mod compute;
mod chart;
mod plan;
mod stability;
mod sweep;
mod bench;
mod completion;
mod verbs;

use std::process::ExitCode;

use crate::{error::CliError, verbs::Cli};

fn main() -> ExitCode {
    let cli: Cli = match nappe_server::command_line(verbs::improved) {
        Ok(cli) => cli,
        Err(code) => return code,
    };
    match run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::note(&format!("nappe: {error}"));
            ExitCode::from(error.exit as u8)
        }
    }
}

fn run(cli: &Cli) -> error::Result<()> {
    nappe_server::check_processor().map_err(CliError::failure)?;
    nappe_server::outlive_file_limits()
        .map_err(|error| CliError::failure(format!("cannot listen to signals: {error}")))?;
    verbs::run(cli)
}
