//! What goes wrong, in words, and the exit code that scripts see.
//!
//! Every lower error enters here once, with what to do about it; `main` prints it and leaves.

use std::{fmt, path::Path};

/// How the command ends, as scripts see it.
pub(crate) use nappe_client::Exit;
use thiserror::Error;

/// A failure: the code, what happened and where, and what to do.
#[derive(Debug, Error)]
pub(crate) struct CliError {
    /// Exit code of the command.
    pub(crate) exit: Exit,
    /// What happened, where, and what is allowed.
    pub(crate) message: String,
    /// What to do about it.
    pub(crate) hint: Option<String>,
}

impl fmt::Display for CliError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)?;
        match &self.hint {
            Some(hint) => write!(f, "\n  {hint}"),
            None => Ok(()),
        }
    }
}

impl CliError {
    /// A failure with this exit code.
    pub(crate) fn new(exit: Exit, message: impl fmt::Display) -> Self {
        Self { exit, message: message.to_string(), hint: None }
    }

    /// A failure without a code of its own.
    pub(crate) fn failure(message: impl fmt::Display) -> Self {
        Self::new(Exit::Failure, message)
    }

    /// A wrong command line.
    pub(crate) fn usage(message: impl fmt::Display) -> Self {
        Self::new(Exit::Usage, message)
    }

    /// A file that cannot be read, written or made.
    pub(crate) fn file(verb: &str, path: &Path, error: &std::io::Error) -> Self {
        Self::failure(format!("cannot {verb} {}: {error}", path.display()))
    }

    /// Adds what to do about it.
    pub(crate) fn hint(mut self, hint: impl fmt::Display) -> Self {
        self.hint = Some(hint.to_string());
        self
    }
}

/// What every verb returns.
pub(crate) type Result<T> = std::result::Result<T, CliError>;
