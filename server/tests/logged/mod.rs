//! A built program that logs to a file, calls of gRPC-Web to it, byte by byte, and lines of its log.

use std::{
    fs::{self, File},
    io::{Read, Write},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
};

use prost::Message;

use crate::support::first_line;

/// A server that logs to a file.
pub(crate) struct Server {
    process: Child,
    pub(crate) log_file: PathBuf,
    /// What it said of its address: host and port, or the path of its socket.
    pub(crate) address: String,
}

impl Server {
    pub(crate) fn start(name: &str, arguments: &[&str]) -> Self {
        let log_file = temporary(&format!("{name}.log"));
        let mut command = Command::new(env!("CARGO_BIN_EXE_nappe-server"));
        command.args(arguments).stdout(Stdio::piped()).stderr(File::create(&log_file).expect("made"));
        let mut process = command.spawn().expect("it starts");
        let line = first_line(process.stdout.take().expect("its output"));
        let address = line.trim().rsplit(' ').next().expect("an address").to_owned();
        let address = address.trim_start_matches("http://").trim_start_matches("unix:").to_owned();
        Self { process, log_file, address }
    }

    /// Its log, after it has ended.
    pub(crate) fn log(mut self) -> String {
        terminate(&self.process);
        assert!(self.process.wait().expect("it ends").success());
        let log = fs::read_to_string(&self.log_file).expect("a text");
        fs::remove_file(&self.log_file).expect("removed");
        log
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A path for a file of this test.
pub(crate) fn temporary(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}-{name}", std::process::id()))
}

/// Asks a program to end.
pub(crate) fn terminate(process: &Child) {
    let sent = Command::new("kill").args(["-TERM", &process.id().to_string()]).status();
    assert!(sent.expect("kill runs").success());
}

/// Makes a call of gRPC-Web on a line of its own, and returns the head of the answer.
pub(crate) fn call(
    mut line: impl Read + Write,
    method: &str,
    headers: &str,
    message: &impl Message,
) -> String {
    send(&mut line, method, headers, message);
    let mut answer = Vec::new();
    line.read_to_end(&mut answer).expect("answered");
    let answer = String::from_utf8_lossy(&answer).into_owned();
    answer.split("\r\n\r\n").next().unwrap_or_default().to_owned()
}

/// Sends what asks for it.
pub(crate) fn send(line: &mut impl Write, method: &str, headers: &str, message: &impl Message) {
    let message = message.encode_to_vec();
    let head = format!(
        "POST /nappe.v1.SimulationService/{method} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
         Content-Type: application/grpc-web+proto\r\nContent-Length: {}\r\n{headers}\r\n",
        message.len() + 5
    );
    let length = (message.len() as u32).to_be_bytes();
    line.write_all(&[head.as_bytes(), &[0], &length, &message].concat()).expect("sent");
}

/// The line of a log that has all of these words.
#[track_caller]
pub(crate) fn line_with<'a>(log: &'a str, words: &[&str]) -> &'a str {
    let has_all = |line: &&str| words.iter().all(|word| line.contains(word));
    log.lines().find(has_all).unwrap_or_else(|| panic!("no line with {words:?} in {log}"))
}
