//! `nappe completions`: the completion script of a shell.

use std::io;

use clap::{Args, CommandFactory as _};
use clap_complete::Shell;

use crate::{args::Cli, error::Result, output};

/// Options of `nappe completions`.
#[derive(Args, Debug)]
pub(crate) struct CompletionsArgs {
    /// The shell
    shell: Shell,
}

/// Runs `nappe completions`.
///
/// # Errors
/// When standard output cannot be written.
pub(crate) fn run(args: &CompletionsArgs) -> Result<()> {
    let mut script = io::Cursor::new(Vec::new());
    clap_complete::generate(args.shell, &mut Cli::command(), "nappe", &mut script);
    output::line(String::from_utf8_lossy(script.get_ref()).trim_end())
}
