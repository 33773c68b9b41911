//! A browser without a screen, which this command tells what to do through a pipe: the DevTools protocol, a message of JSON and a
//! byte of 0 each way. It needs no port that others could reach, and a browser whose pipe is closed ends by itself.
//!
//! Enters: a program and calls of methods. Leaves: their answers, or how the browser failed; no process stays.

use std::{
    io,
    path::{Path, PathBuf},
    process::Stdio,
    time::Duration,
};

use nappe_scene::printable;
use serde_json::{Value, json};
use tokio::{
    io::{AsyncBufReadExt as _, AsyncReadExt as _, AsyncWriteExt as _, BufReader},
    process::{Child, ChildStdin, ChildStdout, Command},
    time::timeout,
};

use super::scratch::{BROWSER, Scratch, last_lines};
use crate::words::error::{CliError, Result};

/// How the shell starts it: it reads messages from 3 and writes them to 4.
const START: &str = r#"exec "$0" "$@" 3<&0 4>&1 0</dev/null 1>/dev/null"#;
/// No sandbox, which root and containers do not have: it opens one page, which this command wrote, and whose policy allows
/// neither scripts but its own nor the network. Where there is no graphics card, it draws by software.
const OPTIONS: [&str; 9] = [
    "--headless=new",
    "--no-sandbox",
    "--enable-unsafe-swiftshader",
    "--disable-dev-shm-usage",
    "--disable-extensions",
    "--no-first-run",
    "--mute-audio",
    "--remote-debugging-pipe",
    "about:blank",
];
/// Most bytes of a message: a picture of the largest size has fewer.
const MOST_BYTES: u64 = 1 << 30;
/// How long a browser that was asked to end may take.
const GOODBYE: Duration = Duration::from_secs(3);
/// How long the end of a browser that closed its pipe may take to be known.
const LAST_WORDS: Duration = Duration::from_secs(10);

/// A browser that runs.
pub(super) struct Browser {
    program: PathBuf,
    log: PathBuf,
    process: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    /// Number of the last call.
    calls: u64,
    /// The page that calls are for, once there is one.
    page: Option<String>,
    /// How long an answer may take.
    patience: Duration,
}

/// Why a call has no answer.
#[derive(Debug)]
pub(super) enum Trouble {
    /// The browser refuses it.
    Refused(String),
    /// The pipe broke, or what comes through it is none of a browser's.
    Broken(io::Error),
    /// Nothing came in time.
    Silent,
}

impl From<io::Error> for Trouble {
    fn from(error: io::Error) -> Self {
        Self::Broken(error)
    }
}

impl Browser {
    /// Starts a browser, whose answers may take so long.
    ///
    /// # Errors
    /// When the system does not start it.
    pub(super) fn start(program: &Path, scratch: &Scratch, patience: Duration) -> Result<Self> {
        let (said, log) = scratch.log(BROWSER)?;
        let mut profile = std::ffi::OsString::from("--user-data-dir=");
        profile.push(scratch.profile());
        let mut command = Command::new("/bin/sh");
        command.args(["-c", START]).arg(program).arg(profile).args(OPTIONS);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(said).kill_on_drop(true);
        // Ctrl-C reaches it through this command alone.
        #[cfg(unix)]
        command.process_group(0);
        let failed = |error: &io::Error| {
            CliError::failure(format!("cannot start the browser {}: {error}", program.display()))
        };
        let mut process = command.spawn().map_err(|error| failed(&error))?;
        let (Some(input), Some(output)) = (process.stdin.take(), process.stdout.take()) else {
            return Err(failed(&io::Error::other("it has no pipes")));
        };
        let output = BufReader::new(output);
        let program = program.to_owned();
        Ok(Self { program, log, process, input, output, calls: 0, page: None, patience })
    }

    /// Sends the calls that follow to a page of its own.
    ///
    /// # Errors
    /// As [`Self::call`].
    pub(super) async fn open_page(&mut self) -> Result<()> {
        let made = self.call("Target.createTarget", json!({ "url": "about:blank" })).await?;
        let attach = json!({ "targetId": made["targetId"], "flatten": true });
        let attached = self.call("Target.attachToTarget", attach).await?;
        self.page = attached["sessionId"].as_str().map(str::to_owned);
        Ok(())
    }

    /// Calls a method and gives its answer.
    ///
    /// # Errors
    /// When the browser refuses, ends or hangs, with what it said last.
    pub(super) async fn call(&mut self, method: &str, parameters: Value) -> Result<Value> {
        match self.ask(method, parameters).await {
            Ok(answer) => Ok(answer),
            Err(trouble) => Err(self.failed(method, trouble).await),
        }
    }

    /// As [`Self::call`], and leaves the trouble to the caller.
    ///
    /// # Errors
    /// When there is no answer.
    pub(super) async fn ask(
        &mut self,
        method: &str,
        parameters: Value,
    ) -> std::result::Result<Value, Trouble> {
        let patience = self.patience;
        timeout(patience, self.exchange(method, parameters)).await.unwrap_or(Err(Trouble::Silent))
    }

    async fn exchange(&mut self, method: &str, parameters: Value) -> std::result::Result<Value, Trouble> {
        self.calls += 1;
        let mut message = json!({ "id": self.calls, "method": method, "params": parameters });
        if let Some(page) = &self.page {
            message["sessionId"] = json!(page);
        }
        self.input.write_all(format!("{message}\0").as_bytes()).await?;
        self.input.flush().await?;
        loop {
            let mut answer = self.next().await?;
            // What is none of this call's tells what happened meanwhile.
            if answer["id"] != self.calls {
                continue;
            }
            if let Some(error) = answer.get("error") {
                let said = error["message"].as_str().unwrap_or("it does not say why");
                return Err(Trouble::Refused(printable(said).into_owned()));
            }
            return Ok(answer["result"].take());
        }
    }

    /// The next message.
    async fn next(&mut self) -> io::Result<Value> {
        let mut bytes = Vec::new();
        (&mut self.output).take(MOST_BYTES).read_until(0, &mut bytes).await?;
        if bytes.pop() != Some(0) {
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, "its pipe was closed"));
        }
        serde_json::from_slice(&bytes).map_err(io::Error::from)
    }

    /// How it failed in a call, in words.
    pub(super) async fn failed(&mut self, method: &str, trouble: Trouble) -> CliError {
        let how = match trouble {
            Trouble::Refused(said) => format!("refuses {method}: {said}"),
            Trouble::Silent => format!("gave no answer to {method} within {} s", self.patience.as_secs_f64()),
            Trouble::Broken(error) if error.kind() == io::ErrorKind::InvalidData => {
                format!("failed in {method}: {error}")
            }
            // Its status says more than its pipe.
            Trouble::Broken(error) => match timeout(LAST_WORDS, self.process.wait()).await {
                Ok(Ok(status)) => format!("ended in {method} ({status})"),
                _ => format!("failed in {method}: {error}"),
            },
        };
        let program = self.program.display();
        CliError::failure(format!("the browser {program} {how}{}", last_lines(&self.log)))
    }

    /// Has it end; one that does not is killed.
    pub(super) async fn close(mut self) {
        self.page = None;
        let ended = timeout(GOODBYE.min(self.patience), async {
            match self.exchange("Browser.close", json!({})).await {
                Ok(_) => self.process.wait().await,
                Err(_) => Err(io::Error::other("it is killed")),
            }
        });
        if !matches!(ended.await, Ok(Ok(_))) {
            // It may have ended already.
            let _ = self.process.kill().await;
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::fs;

    use super::*;

    /// A folder, and a program in it that a shell wrote: a file that this process still holds open cannot be started.
    fn program(name: &str, text: &str) -> (PathBuf, PathBuf) {
        let folder = std::env::temp_dir().join(format!("nappe-browser-{}-{name}", std::process::id()));
        fs::create_dir_all(&folder).expect("a temporary folder");
        let path = folder.join("browser");
        let write = ["-c", "printf '#!/bin/sh\\n%s\\n' \"$1\" > \"$2\" && chmod +x \"$2\"", "sh", text];
        let status = std::process::Command::new("sh").args(write).arg(&path).status();
        assert!(status.expect("there is a shell").success());
        (folder, path)
    }

    #[tokio::test]
    async fn a_browser_that_hangs_is_told_with_its_words_and_killed() {
        let (folder, path) = program("hangs", "echo no screen >&2; echo $$ > \"$0.id\"; exec sleep 600");
        let scratch = Scratch::beside(&folder.join("a.png")).expect("a folder");
        let patience = Duration::from_millis(500);
        let mut browser = Browser::start(&path, &scratch, patience).expect("there is a shell");
        let id = || fs::read_to_string(folder.join("browser.id")).ok().filter(|id| id.ends_with('\n'));
        let error = loop {
            let error = browser.call("Browser.getVersion", json!({})).await.expect_err("it is silent");
            // On a busy machine the shell may not have begun.
            if id().is_some() {
                break error.to_string();
            }
        };
        let parts = ["browser gave no answer to Browser.getVersion within 0.5 s", "no screen"];
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
        browser.close().await;
        let id = id().expect("it began");
        let known = std::process::Command::new("kill").args(["-0", id.trim()]).output();
        assert!(!known.expect("there is kill").status.success(), "it is gone");
        drop(scratch);
        fs::remove_dir_all(folder).expect("it goes");
    }

    #[tokio::test]
    async fn answers_are_those_of_their_calls_and_refusals_are_told() {
        // It hears each call to its end before it says something.
        let heard = |id: u64, method: &str| {
            let bytes = json!({ "id": id, "method": method, "params": {} }).to_string().len() + 1;
            format!("dd bs=1 count={bytes} <&3 >/dev/null 2>&1")
        };
        let said = [
            heard(1, "First"),
            r#"printf '{"method":"Event"}\0{"id":9,"result":1}\0{"id":1,"result":{"a":2}}\0' >&4"#.to_owned(),
            heard(2, "Second"),
            r#"printf '{"id":2,"error":{"message":"no such thing"}}\0{"id":3' >&4; exit 7"#.to_owned(),
        ];
        let (folder, path) = program("answers", &said.join("\n"));
        let scratch = Scratch::beside(&folder.join("a.png")).expect("a folder");
        let mut browser = Browser::start(&path, &scratch, Duration::from_mins(1)).expect("there is a shell");
        assert_eq!(browser.call("First", json!({})).await.expect("an answer"), json!({ "a": 2 }));
        let refused = browser.call("Second", json!({})).await.expect_err("it is refused").to_string();
        assert!(refused.contains("refuses Second: no such thing"), "{refused}");
        let ended = browser.call("Third", json!({})).await.expect_err("it has ended").to_string();
        assert!(ended.contains("ended in Third (exit status: 7)"), "{ended}");
        browser.close().await;
        drop(scratch);
        fs::remove_dir_all(folder).expect("it goes");
    }
}
