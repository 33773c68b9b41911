//! Reads the command line of a program: what it asks for, or the code with which the program ends after help or an error.

use std::{
    io::{self, Write as _},
    process::ExitCode,
};

use clap::Parser;

/// Reads the command line of this program. Help and version are written on standard output, errors on standard error.
///
/// # Errors
/// The code with which the program is to end: 0 after help, 1 if standard output did not take it, 2 after an error.
pub fn command_line<T: Parser>() -> Result<T, ExitCode> {
    T::try_parse().map_err(|answer| {
        let written = answer.print().and_then(|()| io::stdout().flush());
        match written {
            // A reader that closes the pipe early (`nappe --help | head`) has what it wants.
            Err(error) if !answer.use_stderr() && error.kind() != io::ErrorKind::BrokenPipe => {
                let name = T::command().get_name().to_owned();
                say(&format!("{name}: cannot write on standard output: {error}"));
                ExitCode::FAILURE
            }
            _ => ExitCode::from(answer.exit_code() as u8),
        }
    })
}

/// Writes a sentence on standard error; nobody is left to be told when it cannot be written.
pub fn say(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}
