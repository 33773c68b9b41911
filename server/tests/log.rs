//! The log of the built program, written to a file or a pipe: no colour codes, and who made, deleted and was refused what.

#![cfg(unix)]
#![allow(clippy::print_stdout, reason = "a machine without a network is told of")]

mod support;
mod logged;

use std::{
    io::{Read, Write},
    net::{IpAddr, SocketAddr, TcpStream, UdpSocket},
    os::unix::net::UnixStream,
    process::{Command, Stdio},
    time::Instant,
};

use logged::{Server, call, line_with, temporary, terminate};
use nappe_proto::v1::{
    CreateSessionRequest, DeleteSessionRequest, GetSessionRequest, create_session_request::Scene,
};
use support::first_line;

fn connect(server: &Server) -> TcpStream {
    TcpStream::connect(&server.address).expect("it listens")
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

#[test]
fn sessions_that_are_made_and_deleted_are_logged_with_the_address_of_who_did_it() {
    let server = Server::start("sessions", &["--address", "127.0.0.1:0", "--no-token"]);
    let line = connect(&server);
    let maker = line.local_addr().expect("an address").to_string();
    create(line, "first");
    let line = connect(&server);
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
    let line = connect(&server);
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

#[test]
fn who_is_refused_again_and_again_has_a_line_a_second_and_no_call_is_lost() {
    const CALLS: u64 = 200;
    let begin = Instant::now();
    let server = Server::start("again", &["--address", "127.0.0.1:0", "--no-token"]);
    for _ in 0..CALLS {
        call(connect(&server), "GetSession", "", &GetSessionRequest::of("nobody"));
    }
    let log = server.log();
    let lines: Vec<&str> = log.lines().filter(|line| line.contains("SESSION_NOT_FOUND")).collect();
    let count = |line: &str| {
        line.rsplit_once("count=").map_or(1, |(_, count)| count.trim().parse::<u64>().expect("a number"))
    };
    assert_eq!(lines.iter().map(|line| count(line)).sum::<u64>(), CALLS, "{log}");
    // The first, one for each second, and the rest at the end.
    assert!(lines.len() as u64 <= begin.elapsed().as_secs() + 2, "{log}");
}
