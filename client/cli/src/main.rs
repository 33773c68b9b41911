//! The `nappe` command: reads the command line, runs the verb, ends with an exit code.
//!
//! Results go to standard output, everything else to standard error. Modules in reading order:

mod words;
mod files;
mod options;
mod outside;
mod scenes;
mod studies;
mod save;
mod compute;
mod bench;
mod verbs;

use std::process::ExitCode;

use crate::{verbs::Cli, words::error::CliError};

fn main() -> ExitCode {
    let cli: Cli = match nappe_server::command_line(verbs::improved) {
        Ok(cli) => cli,
        Err(code) => return code,
    };
    match run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            words::output::note(&format!("nappe: {error}"));
            ExitCode::from(error.exit as u8)
        }
    }
}

fn run(cli: &Cli) -> words::error::Result<()> {
    nappe_server::check_processor().map_err(CliError::failure)?;
    nappe_server::outlive_file_limits()
        .map_err(|error| CliError::failure(format!("cannot listen to signals: {error}")))?;
    verbs::run(cli)
}
