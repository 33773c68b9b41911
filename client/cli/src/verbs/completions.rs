//! `nappe completions`: the completion script of a shell.

use std::io;

use clap::{Args, Command};
use clap_complete::Shell;

use crate::{error::Result, output};

/// Print the completion script of a shell
#[derive(Args, Debug)]
pub(crate) struct CompletionsArgs {
    /// Shell that reads the script
    shell: Shell,
}

/// Runs `nappe completions`, for the command line that `command` describes.
///
/// # Errors
/// When standard output cannot be written.
pub(crate) fn run(args: &CompletionsArgs, mut command: Command) -> Result<()> {
    let mut script = io::Cursor::new(Vec::new());
    clap_complete::generate(args.shell, &mut command, "nappe", &mut script);
    output::verbatim(String::from_utf8_lossy(script.get_ref()).trim_end())
}
