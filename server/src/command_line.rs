//! Reads the command line of a program: what it asks for, or the code with which the program ends after help or an error.

use std::{
    any::TypeId,
    io::{self, Write as _},
    path::PathBuf,
    process::ExitCode,
};

use clap::{
    Command, Error, Parser,
    error::{ContextKind, ContextValue},
};

/// Reads the command line of this program. Help and version are written on standard output, errors on standard error,
/// as `improved` leaves them.
///
/// # Errors
/// The code with which the program is to end: 0 after help, 1 if standard output did not take it, 2 after an error.
pub fn command_line<T: Parser>(improved: impl FnOnce(Error) -> Error) -> Result<T, ExitCode> {
    let matches = with_negative_numbers(T::command()).try_get_matches();
    let read = matches.and_then(|mut matches| {
        T::from_arg_matches_mut(&mut matches).map_err(|error| error.format(&mut T::command()))
    });
    read.map_err(|answer| {
        let answer = improved(without_dashes(answer));
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

/// An error without the advice to write an unknown option behind `--`, where it would be taken for the name of something.
fn without_dashes(mut error: Error) -> Error {
    if let Some(ContextValue::StyledStrs(mut tips)) = error.remove(ContextKind::Suggested) {
        tips.retain(|tip| !tip.to_string().contains("as a value, use"));
        if !tips.is_empty() {
            error.insert(ContextKind::Suggested, ContextValue::StyledStrs(tips));
        }
    }
    error
}

/// The same command, whose options take `-5` as a value, so that each says what it needs instead; what is a path stays a word.
fn with_negative_numbers(command: Command) -> Command {
    let command = command.mut_args(|arg| {
        let is_path = arg.get_value_parser().type_id() == TypeId::of::<PathBuf>();
        if arg.get_action().takes_values() && !is_path { arg.allow_negative_numbers(true) } else { arg }
    });
    command.mut_subcommands(with_negative_numbers)
}

/// Writes a sentence on standard error; nobody is left to be told when it cannot be written.
pub fn say(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}
