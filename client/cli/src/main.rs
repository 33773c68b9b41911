//! The `nappe` command: reads the command line, runs the verb, ends with an exit code.
//!
//! Results go to standard output, everything else to standard error. Modules in reading order:

mod error;
mod output;
mod write;
mod paths;
mod diagnostics;
mod session;
mod fields;
mod args;
mod remote;
mod ssh;
mod meshes;
mod mesh_info;
mod scene;
mod viewer;
mod save;
mod compute;
mod study;
mod chart;
mod plan;
mod stability;
mod sweep;
mod bench;
mod verbs;

use std::process::ExitCode;

use clap::Parser as _;

use crate::{error::CliError, verbs::Cli};

fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = nappe_server::check_processor().map_err(CliError::failure).and_then(|()| verbs::run(&cli));
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::note(&format!("nappe: {error}"));
            ExitCode::from(error.exit as u8)
        }
    }
}
