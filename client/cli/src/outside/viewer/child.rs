//! A viewer that runs: what it says while it shows sessions, and how it ends.
//!
//! It is in a process group of its own, so that Ctrl-C reaches it through this command alone, and ends when its standard
//! input is closed: by this command, or with it.

use std::{
    collections::VecDeque,
    io,
    process::{ExitStatus, Stdio},
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use nappe_client::{Reason, Token};
use nappe_scene::printable;
use serde::Deserialize;
use tokio::{
    io::AsyncWriteExt as _,
    process::{self, ChildStderr, ChildStdin, ChildStdout, Command},
    sync::{Notify, watch},
    time::timeout,
};

use super::{Form, lines::Lines};
use crate::{
    outside::remote,
    words::{
        error::{CliError, Exit},
        output,
    },
};

/// Lines of standard error that are kept, and characters of each.
const LINES: usize = 20;
const LINE: usize = 500;
/// How long what a viewer said last may be on its way.
const LAST_WORDS: Duration = Duration::from_millis(200);
/// How long one that was asked to end may take to close its recording, or to hand the rest to Rerun, for which it takes 10 s
/// itself. One that hangs does not keep this command.
const GOODBYE: Duration = Duration::from_secs(15);

/// A viewer that was started.
#[derive(Debug)]
pub(crate) struct Child {
    /// It ends when this is closed.
    input: Option<ChildStdin>,
    state: watch::Receiver<State>,
    said: Tail,
    /// Told when it is to be killed.
    kill: Arc<Notify>,
}

/// How far a viewer is.
#[derive(Clone, Debug)]
enum State {
    Started,
    /// The frames of its session come: the session counts it among its watchers.
    Watches,
    Ended(Result<Shown, Failure>),
}

/// What was shown, as a viewer tells at its end.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub(crate) struct Shown {
    /// Frames that came.
    pub(crate) frames: u64,
    /// Frames that were left out.
    pub(crate) dropped: u64,
    /// Whether the session has ended.
    pub(crate) finished: bool,
}

/// Why a viewer failed.
#[derive(Clone, Debug)]
pub(crate) struct Failure {
    exit: Exit,
    message: String,
    /// The server's reason, if it was the server that refused.
    pub(crate) reason: Option<String>,
}

impl Child {
    /// Starts a viewer and tells it a token.
    ///
    /// # Errors
    /// When the system does not start it.
    pub(super) async fn start(mut command: Command, token: Option<&Token>, form: Form) -> io::Result<Self> {
        let stderr = match form {
            Form::Recording => Stdio::piped(),
            Form::View => Stdio::inherit(),
        };
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(stderr).kill_on_drop(true);
        #[cfg(unix)]
        command.process_group(0);
        let mut process = command.spawn()?;

        let said = Tail::default();
        if let Some(stderr) = process.stderr.take() {
            tokio::spawn(said.clone().keep(stderr));
        }
        let stdout = process.stdout.take().ok_or_else(|| io::Error::other("it has no standard output"))?;
        let mut input = process.stdin.take();
        if let (Some(input), Some(token)) = (&mut input, token) {
            // One that does not listen ends, and says why.
            let _ = input.write_all(format!("{}\n", token.reveal()).as_bytes()).await;
        }
        let (told, state) = watch::channel(State::Started);
        let kill = Arc::<Notify>::default();
        let running =
            Running { process, told, answer: None, said: said.clone(), form, kill: Arc::clone(&kill) };
        tokio::spawn(running.end(stdout));
        Ok(Self { input, state, said, kill })
    }

    /// Waits until the frames of its session come, or it has ended.
    pub(crate) async fn watches(&mut self) {
        // Nobody tells it any more when the runtime ends.
        let _ = self.state.wait_for(|state| !matches!(state, State::Started)).await;
    }

    /// Waits for its end, which comes by itself or is asked for: [`Self::finish`].
    ///
    /// # Errors
    /// When it failed, or ended without an answer.
    pub(crate) async fn end(&mut self) -> Result<Shown, Failure> {
        let ended = self.state.wait_for(|state| matches!(state, State::Ended(_))).await;
        match ended.as_deref() {
            Ok(State::Ended(result)) => result.clone(),
            _ => Err(Failure::new("nobody waits for nappe-viewer any more")),
        }
    }

    /// Asks it to end, which closes a recording properly, and waits for that. One that hangs is killed.
    ///
    /// # Errors
    /// As [`Self::end`], and when it had to be killed.
    pub(crate) async fn finish(&mut self) -> Result<Shown, Failure> {
        self.finish_within(GOODBYE).await
    }

    async fn finish_within(&mut self, patience: Duration) -> Result<Shown, Failure> {
        drop(self.input.take());
        if let Ok(ended) = timeout(patience, self.end()).await {
            return ended;
        }
        self.kill.notify_one();
        match self.end().await {
            // It ended by itself after all.
            Ok(shown) => Ok(shown),
            Err(failure) => {
                let (seconds, how) = (patience.as_secs_f64(), failure.message);
                let message = format!("nappe-viewer did not end within {seconds} s and was killed: {how}");
                Err(Failure { exit: Exit::Interrupted, message, reason: failure.reason })
            }
        }
    }

    /// What it said last on standard error, as the end of a message.
    pub(crate) fn last_lines(&self) -> String {
        self.said.text()
    }
}

/// A viewer's process, and whom its end is told.
struct Running {
    process: process::Child,
    told: watch::Sender<State>,
    answer: Option<Line>,
    said: Tail,
    form: Form,
    kill: Arc<Notify>,
}

/// A line that a viewer says.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum Line {
    Watching {
        #[serde(rename = "watching")]
        _session_id: String,
    },
    Note {
        note: String,
    },
    Shown(Shown),
    Failed {
        error: String,
        reason: Option<String>,
    },
}

impl Running {
    /// Hears what it says until it ends. What it started may hold its standard output for longer.
    async fn end(mut self, stdout: ChildStdout) {
        let mut lines = Lines::of(stdout);
        let mut is_open = true;
        let status = loop {
            tokio::select! {
                line = lines.next(), if is_open => match line {
                    Ok(Some(line)) => self.hear(&line),
                    Ok(None) | Err(_) => is_open = false,
                },
                status = self.process.wait() => break status,
                () = self.kill.notified() => {
                    // It may have ended already.
                    let _ = self.process.start_kill();
                }
            }
        };
        while let Ok(Ok(Some(line))) = timeout(LAST_WORDS, lines.next()).await {
            self.hear(&line);
        }
        let result = match status {
            Ok(status) => self.result(status).await,
            Err(error) => Err(Failure::new(format!("cannot wait for nappe-viewer: {error}"))),
        };
        self.told.send_replace(State::Ended(result));
    }

    /// Hears a line. What is none of a viewer's comes from what it called, and says nothing here.
    fn hear(&mut self, line: &str) {
        match serde_json::from_str(line) {
            Ok(Line::Watching { .. }) => {
                self.told.send_replace(State::Watches);
            }
            Ok(Line::Note { note }) => output::note(&format!("nappe: {note}")),
            Ok(last) => self.answer = Some(last),
            Err(_other) => {}
        }
    }

    /// What its end means.
    async fn result(&mut self, status: ExitStatus) -> Result<Shown, Failure> {
        match self.answer.take() {
            Some(Line::Shown(shown)) => Ok(shown),
            Some(Line::Failed { error, reason }) => {
                Err(Failure { exit: exit(status), message: error, reason })
            }
            _ => {
                tokio::time::sleep(LAST_WORDS).await;
                let watched = matches!(*self.told.borrow(), State::Watches);
                let kept = match self.form {
                    Form::Recording if watched => "; the recording holds what was written until then",
                    _ => "",
                };
                let lines = self.said.text();
                Err(Failure::new(format!("nappe-viewer ended without an answer ({status}){kept}{lines}")))
            }
        }
    }
}

/// What an exit code means: it is one of this command's.
fn exit(status: ExitStatus) -> Exit {
    let code = |exit: &Exit| status.code() == Some(*exit as i32);
    let exits = [Exit::Usage, Exit::Diverged, Exit::Unreachable, Exit::Refused, Exit::Interrupted];
    exits.into_iter().find(code).unwrap_or(Exit::Failure)
}

impl Failure {
    fn new(message: impl Into<String>) -> Self {
        Self { exit: Exit::Failure, message: message.into(), reason: None }
    }
}

impl From<Failure> for CliError {
    fn from(failure: Failure) -> Self {
        let error = Self::new(failure.exit, failure.message);
        match failure.reason.as_deref().and_then(Reason::of).and_then(remote::remedy) {
            Some(hint) => error.hint(hint),
            None => error,
        }
    }
}

/// The last lines of a pipe.
#[derive(Clone, Debug, Default)]
struct Tail(Arc<Mutex<VecDeque<String>>>);

impl Tail {
    /// Keeps them until the pipe ends.
    async fn keep(self, pipe: ChildStderr) {
        let mut lines = Lines::of(pipe);
        while let Ok(Some(line)) = lines.next().await {
            let line: String = line.chars().take(LINE).collect();
            let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            kept.push_back(printable(&line).into_owned());
            if kept.len() > LINES {
                kept.pop_front();
            }
        }
    }

    /// They, as the end of a message.
    fn text(&self) -> String {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let lines: Vec<&str> = kept.iter().map(String::as_str).collect();
        if lines.is_empty() { String::new() } else { format!(". Its last lines:\n{}", lines.join("\n")) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_of_a_viewer_is_understood_and_no_other() {
        let heard = |line: &str| serde_json::from_str::<Line>(line).ok();
        assert!(matches!(heard(r#"{"watching":"first"}"#), Some(Line::Watching { .. })));
        assert!(matches!(heard(r#"{"note":"back"}"#), Some(Line::Note { note }) if note == "back"));
        let shown = r#"{"session_id":"first","frames":3,"dropped":1,"finished":true,"saved":null}"#;
        let expected = Shown { frames: 3, dropped: 1, finished: true };
        assert!(matches!(heard(shown), Some(Line::Shown(shown)) if shown == expected));
        let failed = heard(r#"{"error":"no","reason":null}"#);
        assert!(matches!(failed, Some(Line::Failed { reason: None, .. })));
        assert!(heard("rerun is listening").is_none() && heard("{}").is_none());
    }

    #[cfg(unix)]
    #[tokio::test]
    async fn a_viewer_that_hangs_is_killed_when_it_is_asked_to_end() {
        let mut command = Command::new("sh");
        // Nothing but a kill ends it, as one that was stopped.
        command.args(["-c", "trap '' INT TERM; echo '{\"watching\":\"first\"}'; exec sleep 60"]);
        let mut child = Child::start(command, None, Form::Recording).await.expect("there is a shell");
        child.watches().await;
        let failure = child.finish_within(Duration::from_millis(20)).await.expect_err("it was killed");
        let parts = ["within 0.02 s and was killed", "signal: 9", "what was written until then"];
        assert!(parts.iter().all(|part| failure.message.contains(part)), "{}", failure.message);
        assert_eq!(failure.exit, Exit::Interrupted);
    }
}
