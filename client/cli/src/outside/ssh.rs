//! The system's ssh: a command on another machine, and a port forwarded to it, over one connection.
//!
//! Enters: a destination and options of ssh. Leaves: the first line that the command writes, and a forwarded port.
//! Keys, passwords, known hosts and the user's configuration are ssh's own business, and so is what it refuses.

use std::{
    io::{BufRead as _, BufReader, Read as _},
    net::{Ipv4Addr, SocketAddr, TcpListener},
    path::{Path, PathBuf},
    process::{Child, ChildStdin, Command, ExitStatus, Stdio},
    time::{Duration, Instant},
};

use clap::Args;

use crate::words::error::{CliError, Exit, Result};

/// How long the other end may take to end after its input was closed: a drain, and a little.
const END_TIME: Duration = Duration::from_secs(8);
/// How often it is asked whether it has ended.
const INTERVAL: Duration = Duration::from_millis(50);
/// How long an end of ssh is kept back: Ctrl-C at a terminal ends ssh as well, and whoever waits for both hears of the
/// signal first.
const SIGNAL_TIME: Duration = Duration::from_millis(50);
/// Most bytes of the first line that are read.
const LINE_BYTES: u64 = 64 << 10;
/// Attempts to forward a free port that somebody else may take meanwhile.
const ATTEMPTS: usize = 3;
/// What ssh ends with when it is ssh that failed.
const SSH_FAILED: i32 = 255;
/// What a shell ends with when there is no such program.
const NOT_FOUND: i32 = 127;

/// Where to, and how.
#[derive(Args, Clone, Debug)]
pub(crate) struct SshArgs {
    /// Machine, and user there, as ssh takes them
    #[arg(value_name = "[USER@]HOST")]
    pub(crate) destination: String,
    /// Machine to go through, as `ssh -J` takes it
    #[arg(long, value_name = "[USER@]HOST")]
    jump: Option<String>,
    /// Option of ssh, as `ssh -o` takes it: Port=2222, IdentityFile=key
    #[arg(long = "ssh-option", value_name = "KEY=VALUE")]
    options: Vec<String>,
}

/// A command that runs on another machine. Dropping it ends it.
#[derive(Debug)]
pub(crate) struct FarCommand {
    args: SshArgs,
    process: Child,
    /// Open as long as the command is to run.
    input: Option<ChildStdin>,
    /// Socket over which the connection is used again.
    control: PathBuf,
}

impl FarCommand {
    /// Starts a command there. `folder` is this user's alone.
    ///
    /// # Errors
    /// When there is no ssh, or the destination is none.
    pub(crate) fn start(args: &SshArgs, folder: &Path, words: &[&str]) -> Result<Self> {
        if args.destination.starts_with('-') {
            return Err(CliError::usage(format!("'{}' is no machine", args.destination)));
        }
        let control = folder.join(format!("ssh-{}", std::process::id()));
        let mut ssh = ssh(args, &control);
        ssh.args(["-T", "-o", "ControlMaster=yes", "-o", "ControlPersist=no", &args.destination]);
        ssh.arg(words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" "));
        let mut process = ssh
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| CliError::failure(format!("ssh cannot be started: {error}")))?;

        let input = process.stdin.take();
        Ok(Self { args: args.clone(), process, input, control })
    }

    /// Waits for the first line that the command, which runs `program`, writes: ssh may ask for a password meanwhile.
    ///
    /// # Errors
    /// When ssh does not come through, or the command ends without a line.
    pub(crate) async fn first_line(&mut self, program: &str) -> Result<String> {
        let output = self.process.stdout.take();
        let read = tokio::task::spawn_blocking(move || {
            let mut line = String::new();
            let read = output.map(|output| BufReader::new(output.take(LINE_BYTES)).read_line(&mut line));
            matches!(read, Some(Ok(1..))).then_some(line)
        });
        if let Ok(Some(line)) = read.await {
            return Ok(line);
        }
        tokio::time::sleep(SIGNAL_TIME).await;
        Err(self.silent(program))
    }

    /// Ends ssh at once, and with it what it started.
    pub(crate) fn abort(mut self) {
        // It may have ended already.
        let _ = self.process.kill();
    }

    /// Forwards a port of this machine's loopback, 0 for a free one, to an address there.
    ///
    /// # Errors
    /// When ssh refuses.
    pub(crate) fn forward(&self, port: u16, to: SocketAddr) -> Result<SocketAddr> {
        for _ in 0..ATTEMPTS {
            let here = free(port)?;
            let mut ssh = ssh(&self.args, &self.control);
            ssh.args(["-O", "forward", "-L", &format!("{here}:{to}"), &self.args.destination]);
            let forwarded = ssh.stdin(Stdio::null()).stdout(Stdio::null()).status();
            if forwarded.is_ok_and(|status| status.success()) {
                return Ok(here);
            }
            if port != 0 {
                break;
            }
        }
        Err(CliError::failure(format!("ssh does not forward a port to {to} on {}", self.args.destination)))
    }

    /// Waits until the connection ends by itself, which it does only if it broke.
    pub(crate) async fn broken(&mut self) -> CliError {
        loop {
            if let Ok(Some(status)) = self.process.try_wait() {
                tokio::time::sleep(SIGNAL_TIME).await;
                let message = format!("the connection to {} ended ({status})", self.args.destination);
                return CliError::new(Exit::Unreachable, message);
            }
            tokio::time::sleep(INTERVAL).await;
        }
    }

    /// Why there was no line.
    fn silent(&mut self, program: &str) -> CliError {
        let machine = self.args.destination.clone();
        match self.end().and_then(|status| status.code()) {
            Some(SSH_FAILED) => {
                CliError::new(Exit::Unreachable, format!("ssh does not reach {machine}; it says why above"))
            }
            Some(NOT_FOUND) => CliError::failure(format!("there is no program '{program}' on {machine}"))
                .hint("install nappe there, or name it with --program PATH"),
            code => CliError::failure(format!(
                "'{program}' on {machine} ended without an answer (code {})",
                code.map_or_else(|| "unknown".to_owned(), |code| code.to_string())
            )),
        }
    }

    /// Closes the input of the command, so that it ends, and waits for it.
    fn end(&mut self) -> Option<ExitStatus> {
        drop(self.input.take());
        let begin = Instant::now();
        while begin.elapsed() < END_TIME {
            if let Ok(Some(status)) = self.process.try_wait() {
                return Some(status);
            }
            std::thread::sleep(INTERVAL);
        }
        // It has ended by now, or nothing more can be done from here.
        let _ = self.process.kill();
        self.process.wait().ok()
    }
}

impl Drop for FarCommand {
    fn drop(&mut self) {
        self.end();
        // ssh removes it; one that was killed does not.
        let _ = std::fs::remove_file(&self.control);
    }
}

fn ssh(args: &SshArgs, control: &Path) -> Command {
    let mut ssh = Command::new("ssh");
    ssh.arg("-o").arg(format!("ControlPath={}", control.display()));
    if let Some(jump) = &args.jump {
        ssh.args(["-J", jump]);
    }
    for option in &args.options {
        ssh.args(["-o", option]);
    }
    ssh
}

/// An address of loopback at which nobody listens.
fn free(port: u16) -> Result<SocketAddr> {
    let wanted = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
    let listener = TcpListener::bind(wanted).and_then(|listener| listener.local_addr());
    listener.map_err(|error| CliError::failure(format!("cannot listen on {wanted}: {error}")))
}

/// A word as the shell there reads it.
fn quoted(word: &str) -> String {
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_reach_the_shell_there_as_they_are() {
        assert_eq!(quoted("nappe"), "'nappe'");
        assert_eq!(quoted("it's $HOME; rm"), r"'it'\''s $HOME; rm'");
    }
}
