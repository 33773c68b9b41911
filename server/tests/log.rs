//! The log of the built program, written to a file or a pipe: no colour codes, and who made, deleted and was refused what.

#![cfg(unix)]
#![allow(clippy::print_stdout, reason = "a machine without a network is told of")]

mod support;

use std::{
    fs::{self, File},
    io::{Read, Write},
    net::{IpAddr, SocketAddr, TcpStream, UdpSocket},
    os::unix::net::UnixStream,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
};

use nappe_proto::v1::{CreateSessionRequest, DeleteSessionRequest, create_session_request::Scene};
use prost::Message;
use support::first_line;

/// A server that logs to a file.
struct Server {
    process: Child,
    log: PathBuf,
    /// What it said of its address: host and port, or the path of its socket.
    address: String,
}

impl Server {
    fn start(name: &str, arguments: &[&str]) -> Self {
        let log = temporary(&format!("{name}.log"));
        let mut command = Command::new(env!("CARGO_BIN_EXE_nappe-server"));
        command.args(arguments).stdout(Stdio::piped()).stderr(File::create(&log).expect("made"));
        let mut process = command.spawn().expect("it starts");
        let line = first_line(process.stdout.take().expect("its output"));
        let address = line.trim().rsplit(' ').next().expect("an address").to_owned();
        let address = address.trim_start_matches("http://").trim_start_matches("unix:").to_owned();
        Self { process, log, address }
    }

    fn connect(&self) -> TcpStream {
        TcpStream::connect(&self.address).expect("it listens")
    }

    /// Its log, after it has ended.
    fn log(mut self) -> String {
        terminate(&self.process);
        assert!(self.process.wait().expect("it ends").success());
        let log = fs::read_to_string(&self.log).expect("a text");
        fs::remove_file(&self.log).expect("removed");
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

fn temporary(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}-{name}", std::process::id()))
}

fn terminate(process: &Child) {
    let sent = Command::new("kill").args(["-TERM", &process.id().to_string()]).status();
    assert!(sent.expect("kill runs").success());
}

/// Makes a call of gRPC-Web on a line of its own, and returns the head of the answer.
fn call(mut line: impl Read + Write, method: &str, headers: &str, message: &impl Message) -> String {
    let message = message.encode_to_vec();
    let head = format!(
        "POST /nappe.v1.SimulationService/{method} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
         Content-Type: application/grpc-web+proto\r\nContent-Length: {}\r\n{headers}\r\n",
        message.len() + 5
    );
    let length = (message.len() as u32).to_be_bytes();
    line.write_all(&[head.as_bytes(), &[0], &length, &message].concat()).expect("sent");
    let mut answer = Vec::new();
    line.read_to_end(&mut answer).expect("answered");
    let answer = String::from_utf8_lossy(&answer).into_owned();
    answer.split("\r\n\r\n").next().unwrap_or_default().to_owned()
}

fn create(line: impl Read + Write, id: &str) {
    let scene = Some(Scene::SceneName("demo".to_owned()));
    let request = CreateSessionRequest {
        session_id: id.to_owned(),
        scene,
        thread_count: 1,
        ..CreateSessionRequest::default()
    };
    let head = call(line, "CreateSession", "", &request);
    assert!(head.starts_with("HTTP/1.1 200") && !head.contains("\r\ngrpc-status:"), "{head}");
}

/// The line of a log that has all of these words.
#[track_caller]
fn line_with<'a>(log: &'a str, words: &[&str]) -> &'a str {
    let has_all = |line: &&str| words.iter().all(|word| line.contains(word));
    log.lines().find(has_all).unwrap_or_else(|| panic!("no line with {words:?} in {log}"))
}

#[test]
fn sessions_that_are_made_and_deleted_are_logged_with_the_address_of_who_did_it() {
    let server = Server::start("sessions", &["--address", "127.0.0.1:0", "--no-token"]);
    let line = server.connect();
    let maker = line.local_addr().expect("an address").to_string();
    create(line, "first");
    let line = server.connect();
    let deleter = line.local_addr().expect("an address").to_string();
    let request = DeleteSessionRequest { session_id: "first".to_owned(), ..DeleteSessionRequest::default() };
    call(line, "DeleteSession", "", &request);

    let log = server.log();
    line_with(&log, &[" INFO ", "created", "first", &format!("caller={maker}")]);
    line_with(&log, &[" INFO ", "deleted", "first", &format!("caller={deleter}")]);
    assert!(!log.contains("connected"), "loopback is not elsewhere: {log}");
    assert!(!log.contains('\u{1b}'), "a file has no colours: {log:?}");
}

#[test]
fn a_caller_that_is_refused_is_logged_without_what_it_showed() {
    let server = Server::start("refused", &["--address", "127.0.0.1:0"]);
    let line = server.connect();
    let caller = line.local_addr().expect("an address").to_string();
    let request = DeleteSessionRequest::default();
    let head = call(line, "DeleteSession", "Authorization: Bearer 0123456789abcdef\r\n", &request);
    assert!(head.contains("grpc-status: 16"), "{head}");

    let log = server.log();
    line_with(&log, &[" INFO ", "refused", "TOKEN_WRONG", &format!("caller={caller}")]);
    assert!(!log.contains("0123456789abcdef"), "{log}");
}

#[test]
fn a_caller_on_a_unix_socket_is_called_unix() {
    let socket = temporary("log.sock");
    let address = format!("unix:{}", socket.display());
    let server = Server::start("unix", &["--address", &address]);
    create(UnixStream::connect(&socket).expect("it listens"), "first");
    line_with(&server.log(), &[" INFO ", "created", "first", "caller=unix"]);
}

/// An address of this machine that is not loopback, if it has one. Nothing is sent: the system only chooses a way.
fn own_address() -> Option<IpAddr> {
    let socket = UdpSocket::bind("0.0.0.0:0").ok()?;
    socket.connect("192.0.2.1:9").ok()?;
    Some(socket.local_addr().ok()?.ip()).filter(|address| !address.is_loopback() && !address.is_unspecified())
}

#[test]
fn connections_from_elsewhere_are_logged() {
    let Some(here) = own_address() else {
        println!("not checked: this machine has no address but loopback");
        return;
    };
    let server = Server::start("elsewhere", &["--address", "0.0.0.0:0", "--allow-remote", "--no-token"]);
    let port = server.address.parse::<SocketAddr>().expect("an address").port();
    let line = TcpStream::connect((here, port)).expect("it listens");
    let caller = line.local_addr().expect("an address").to_string();
    create(line, "first");

    let log = server.log();
    line_with(&log, &[" INFO ", "connected", &format!("caller={caller}")]);
    line_with(&log, &[" INFO ", "created", "first", &format!("caller={caller}")]);
}

#[test]
fn a_pipe_has_no_colours_either() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_nappe-server"));
    command.args(["--address", "127.0.0.1:0", "--no-token"]).env("TERM", "xterm-256color");
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut server = command.spawn().expect("it starts");
    let said = first_line(server.stdout.take().expect("its output"));
    let address = said.trim().rsplit_once("http://").expect("an address").1;
    create(TcpStream::connect(address).expect("it listens"), "first");
    terminate(&server);
    let log = String::from_utf8(server.wait_with_output().expect("it ends").stderr).expect("a text");
    line_with(&log, &[" INFO ", "created", "first"]);
    assert!(!log.contains('\u{1b}'), "{log:?}");
}
