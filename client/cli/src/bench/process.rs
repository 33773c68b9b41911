//! A server in a process of its own: its memory and processor time are told from those of its clients.

use std::{
    io::{BufRead as _, BufReader},
    process::{Child, Command, Stdio},
};

use nappe_client::Client;

use crate::words::error::{CliError, Result};

/// Ticks per second in which Linux counts processor time.
const TICKS_PER_SECOND: f64 = 100.0;

/// A running `nappe serve`, which ends with this value.
#[derive(Debug)]
pub(super) struct ServerProcess {
    child: Child,
    url: String,
}

impl ServerProcess {
    /// Starts one on a free port of loopback, with further options.
    ///
    /// # Errors
    /// When the process cannot be started, or says nothing of its address.
    pub(super) fn start(options: &[&str]) -> Result<Self> {
        let failed = |what: &str, error: &dyn std::fmt::Display| {
            CliError::failure(format!("cannot start a server to be measured: {what}: {error}"))
        };
        let program = std::env::current_exe().map_err(|error| failed("this program has no path", &error))?;
        let mut child = Command::new(program)
            .args(["serve", "--json", "--log", "error", "--address", "127.0.0.1:0"])
            .args(options)
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| failed("it does not run", &error))?;

        let mut line = String::new();
        let stdout = child.stdout.take().ok_or_else(|| failed("it has no output", &""))?;
        BufReader::new(stdout).read_line(&mut line).map_err(|error| failed("it says nothing", &error))?;
        let said: serde_json::Value =
            serde_json::from_str(&line).map_err(|error| failed("it names no address", &error))?;
        let url = said["url"].as_str().unwrap_or_default().to_owned();
        Ok(Self { child, url })
    }

    /// A client with a connection of its own.
    ///
    /// # Errors
    /// When the server does not answer.
    pub(super) async fn connect(&self) -> Result<Client> {
        Ok(Client::connect(&self.url).await?)
    }

    /// Memory that the server has in use (bytes).
    ///
    /// # Errors
    /// Where the system has no `/proc`.
    pub(super) fn resident_bytes(&self) -> Result<f64> {
        let pages = proc_field(&self.child.id().to_string(), "statm", 1)?;
        Ok(pages * 4096.0)
    }

    /// Processor time that the server has used (s), of all of its threads.
    ///
    /// # Errors
    /// Where the system has no `/proc`.
    pub(super) fn cpu_seconds(&self) -> Result<f64> {
        used_seconds(&self.child.id().to_string())
    }
}

/// Processor time that the calling thread has used (s).
///
/// # Errors
/// Where the system has no `/proc`.
pub(super) fn thread_seconds() -> Result<f64> {
    used_seconds("thread-self")
}

/// User and system time of a process or a thread (s).
fn used_seconds(who: &str) -> Result<f64> {
    // They come after the name, which has no spaces.
    Ok((proc_field(who, "stat", 13)? + proc_field(who, "stat", 14)?) / TICKS_PER_SECOND)
}

fn proc_field(who: &str, file: &str, field: usize) -> Result<f64> {
    let path = format!("/proc/{who}/{file}");
    let text = std::fs::read_to_string(&path).unwrap_or_default();
    let number = text.split_whitespace().nth(field).and_then(|number| number.parse().ok());
    number.ok_or_else(|| {
        CliError::failure(format!("cannot read {path}: this suite measures processes on Linux only"))
    })
}

impl Drop for ServerProcess {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
