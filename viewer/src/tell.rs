//! What the program says: sentences on standard error for people, or lines of JSON on standard output for programs.
//!
//! Of JSON, standard output has one object per line: `watching`, the session's id, when its frames come, `note` while
//! something is worth telling, and last either what was shown (`session_id`, `frames`, `dropped`, `finished`, `saved`)
//! or `error`, with the server's `reason` or null.

use std::{
    fmt,
    io::{self, Write as _},
    path::Path,
    process::ExitCode,
};

use nappe_client::{ClientError, Event, Exit, Reason};
use nappe_rerun::{ShowError, Shown};
use serde_json::{Value, json};

/// Who reads what the program says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Audience {
    /// A person at a terminal, who reads standard error.
    Person,
    /// A program, which reads standard output.
    Program,
}

/// Why the program fails.
#[derive(Debug)]
pub(crate) struct Failure {
    /// Exit code of the program.
    pub(crate) exit: Exit,
    message: String,
    /// The server's reason, if it refused.
    reason: Option<String>,
}

impl Audience {
    /// Tells what is worth knowing while the program goes on.
    pub(crate) fn note(self, text: &str) {
        match self {
            Self::Person => say(text),
            Self::Program => write(&json!({ "note": text })),
        }
    }

    /// Tells of an event in the stream of a session, if that is worth knowing.
    pub(crate) fn event(self, session_id: &str, event: &Event) {
        match event {
            // The first that comes: from here on, the session counts this watcher.
            Event::Topology(_) if self == Self::Program => write(&json!({ "watching": session_id })),
            Event::Broken { cause } => self.note(&format!("{cause}; the stream is asked for again")),
            Event::Reconnected { attempts, cause } => {
                self.note(&format!("the connection broke ({cause}) and is back after {attempts} attempts"));
            }
            _ => {}
        }
    }

    /// Tells what was shown.
    pub(crate) fn shown(self, session_id: &str, shown: &Shown, saved: Option<&Path>) {
        let Shown { frame_count, dropped_count, end } = shown;
        match self {
            Self::Person => {
                let end = end.map_or_else(
                    || "stopped".to_owned(),
                    |end| format!("the session ended after step {}, state {:016x}", end.step, end.state_hash),
                );
                say(&format!("{frame_count} frames shown, {dropped_count} left out; {end}"));
            }
            Self::Program => write(&json!({
                "session_id": session_id,
                "frames": frame_count,
                "dropped": dropped_count,
                "finished": end.is_some(),
                "saved": saved,
            })),
        }
    }

    /// Tells why the program fails.
    pub(crate) fn failed(self, failure: &Failure) {
        match self {
            Self::Person => {
                say(&format!("nappe-viewer: {failure}"));
                if let Some(reason) = failure.reason.as_deref().and_then(Reason::of) {
                    say(&format!("  {}", reason.remedy()));
                }
            }
            Self::Program => write(&json!({ "error": failure.message, "reason": failure.reason })),
        }
    }
}

impl Failure {
    /// A wrong command line.
    pub(crate) fn usage(message: impl fmt::Display) -> Self {
        Self { exit: Exit::Usage, ..Self::new(message) }
    }

    /// A failure without a code of its own.
    pub(crate) fn new(message: impl fmt::Display) -> Self {
        Self { exit: Exit::Failure, message: message.to_string(), reason: None }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl From<ClientError> for Failure {
    fn from(error: ClientError) -> Self {
        Self {
            exit: Exit::from(&error),
            message: error.to_string(),
            reason: error.reason().map(str::to_owned),
        }
    }
}

impl From<ShowError> for Failure {
    fn from(error: ShowError) -> Self {
        match error {
            ShowError::Client(error) => error.into(),
            error => Self::new(error),
        }
    }
}

/// Tells help, version, or what is wrong with the command line; the code with which the program ends.
pub(crate) fn answered(answer: &clap::Error) -> ExitCode {
    let written = answer.print().and_then(|()| io::stdout().flush());
    match written {
        // A reader that closes the pipe early has what it wants.
        Err(error) if !answer.use_stderr() && error.kind() != io::ErrorKind::BrokenPipe => {
            unwritten(&error);
            ExitCode::from(Exit::Failure as u8)
        }
        _ => ExitCode::from(answer.exit_code() as u8),
    }
}

/// Writes a line on standard error; nobody is left to be told when it is closed.
fn say(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Writes a line of JSON on standard output; whoever closed it wants none.
fn write(value: &Value) {
    let mut out = io::stdout().lock();
    match writeln!(out, "{value}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => unwritten(&error),
        _ => {}
    }
}

fn unwritten(error: &io::Error) {
    say(&format!("nappe-viewer: cannot write on standard output: {error}"));
}
