//! The program `nappe-server` as a process: address, refusal, signals.

use std::{
    io::{BufRead as _, BufReader, Write as _},
    net::TcpStream,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

fn program(arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_nappe-server"))
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts")
}

/// The first line says where the server listens.
fn address(server: &mut Child) -> String {
    let mut line = String::new();
    let output = server.stdout.take().expect("its output");
    BufReader::new(output).read_line(&mut line).expect("a line");
    line.trim().strip_prefix("nappe-server listens on http://").expect("an address").to_owned()
}

#[cfg(unix)]
fn terminate(server: &Child) {
    let sent = Command::new("kill").args(["-TERM", &server.id().to_string()]).status();
    assert!(sent.expect("kill runs").success());
}

#[cfg(unix)]
#[test]
fn a_second_signal_ends_the_program_at_once() {
    // HTTP/2 is opened, and nothing is answered after it: such a connection lasts as long as a drain may.
    const OPENING: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0";
    let mut server = program(&["--address", "127.0.0.1:0", "--drain-seconds", "300"]);
    let mut deaf = TcpStream::connect(address(&mut server)).expect("it listens");
    deaf.write_all(OPENING).expect("sent");
    thread::sleep(Duration::from_millis(300));

    terminate(&server);
    thread::sleep(Duration::from_millis(500));
    assert!(server.try_wait().expect("it can be asked").is_none(), "the first signal drains");
    let begin = Instant::now();
    terminate(&server);
    assert_eq!(server.wait().expect("it ends").code(), Some(130));
    assert!(begin.elapsed() < Duration::from_mins(1), "{:?}", begin.elapsed());
}

#[cfg(unix)]
#[test]
fn a_signal_ends_the_program_with_code_0() {
    for signal in ["-INT", "-TERM"] {
        let mut server = program(&["--address", "127.0.0.1:0"]);
        let address = address(&mut server);
        let silent = TcpStream::connect(address).expect("it listens");
        let sent = Command::new("kill").args([signal, &server.id().to_string()]).status();
        assert!(sent.expect("kill runs").success());
        let status = server.wait().expect("it ends");
        assert!(status.success(), "{signal}: {status}");
        drop(silent);
    }
}

#[test]
fn an_address_that_others_reach_is_refused_with_a_reason() {
    let refused = program(&["--address", "0.0.0.0:0"]).wait_with_output().expect("it ends");
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(!refused.status.success() && message.contains("--allow-remote"), "{message}");
}

#[cfg(target_arch = "x86_64")]
#[test]
fn a_processor_without_avx2_is_told_so_in_one_line() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_nappe-server"));
    let refused = command.env("NAPPE_HIDE_AVX2", "1").output().expect("it ends");
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(1), "{message}");
    assert!(message.starts_with("nappe-server: this processor has no AVX2"), "{message}");
    assert_eq!(message.lines().count(), 1, "{message}");
}

#[test]
fn the_environment_sets_what_flags_do_not() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_nappe-server"));
    let refused = command.env("NAPPE_ADDRESS", "0.0.0.0:0").output().expect("it ends");
    assert!(!refused.status.success());
    let mut command = Command::new(env!("CARGO_BIN_EXE_nappe-server"));
    let help = command.arg("--help").output().expect("it ends");
    let help = String::from_utf8_lossy(&help.stdout).into_owned();
    for knob in ["NAPPE_ADDRESS", "--max-sessions", "--allow-origin", "--drain-seconds"] {
        assert!(help.contains(knob), "{knob} in {help}");
    }
}
