//! The program `nappe-server` as a process: address, refusal, signals.

mod support;

use std::{
    io::{Read as _, Write as _},
    net::TcpStream,
    process::{Child, Command, ExitStatus, Stdio},
    thread,
    time::{Duration, Instant},
};

use support::first_line;

/// Whatever takes this long hangs.
const PATIENCE: Duration = Duration::from_mins(1);

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
    let line = first_line(server.stdout.take().expect("its output"));
    line.trim().strip_prefix("nappe-server listens on http://").expect("an address").to_owned()
}

/// Waits for the end of a program.
#[cfg(unix)]
fn end(program: &mut Child) -> ExitStatus {
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        if let Some(status) = program.try_wait().expect("it can be asked") {
            return status;
        }
        thread::sleep(Duration::from_millis(20));
    }
    program.kill().expect("it is ended");
    panic!("it does not end");
}

/// A connection whose call is in progress until a drain is over: nothing of its answer may be sent but the headers.
#[cfg(unix)]
fn deaf(address: &str) -> TcpStream {
    const OPENING: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
    /// Streams that may be sent no bytes unasked.
    const SETTINGS: &[u8] = &[0, 0, 6, 4, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0, 0];
    /// An empty message, the last of its stream.
    const MESSAGE: &[u8] = &[0, 0, 5, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0];
    const HEADERS: u8 = 1;

    let pairs = [
        (":method", "POST"),
        (":scheme", "http"),
        (":authority", "localhost"),
        (":path", "/nappe.v1.SimulationService/GetServerInfo"),
        ("content-type", "application/grpc"),
        ("te", "trailers"),
    ];
    let mut block = Vec::new();
    for (name, value) in pairs {
        // Written out, and not for the table.
        block.push(0);
        for text in [name, value] {
            block.push(text.len() as u8);
            block.extend(text.bytes());
        }
    }
    let head = [0, 0, block.len() as u8, HEADERS, 4, 0, 0, 0, 1];
    let call = [&head[..], &block].concat();

    let mut stream = TcpStream::connect(address).expect("it listens");
    stream.set_read_timeout(Some(PATIENCE)).expect("set");
    stream.write_all(&[OPENING, SETTINGS, &call, MESSAGE].concat()).expect("sent");
    loop {
        let mut head = [0; 9];
        stream.read_exact(&mut head).expect("a frame");
        let mut content = vec![0; u32::from_be_bytes([0, head[0], head[1], head[2]]) as usize];
        stream.read_exact(&mut content).expect("a whole frame");
        if head[3] == HEADERS {
            return stream;
        }
    }
}

/// Waits until nobody listens at an address.
#[cfg(unix)]
fn until_closed(address: &str) {
    let begin = Instant::now();
    while TcpStream::connect(address).is_ok() {
        assert!(begin.elapsed() < PATIENCE, "it listens on");
        thread::sleep(Duration::from_millis(20));
    }
}

#[cfg(unix)]
fn terminate(server: &Child) {
    let sent = Command::new("kill").args(["-TERM", &server.id().to_string()]).status();
    assert!(sent.expect("kill runs").success());
}

#[cfg(unix)]
#[test]
fn a_second_signal_ends_the_program_at_once() {
    let mut server = program(&["--address", "127.0.0.1:0", "--no-token", "--drain-seconds", "300"]);
    let address = address(&mut server);
    let deaf = deaf(&address);

    terminate(&server);
    until_closed(&address);
    assert!(server.try_wait().expect("it can be asked").is_none(), "the first signal drains");
    terminate(&server);
    assert_eq!(end(&mut server).code(), Some(130));
    drop(deaf);
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
        let status = end(&mut server);
        assert!(status.success(), "{signal}: {status}");
        drop(silent);
    }
}

#[cfg(unix)]
#[test]
fn a_server_that_was_asked_to_ends_when_its_input_closes_and_not_before() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_nappe-server"));
    command.args(["--address", "127.0.0.1:0", "--no-token", "--until-stdin-closes"]);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut server = command.spawn().expect("the program starts");
    let address = address(&mut server);
    let mut input = server.stdin.take().expect("its input is a pipe");
    input.write_all(b"what is written means nothing\n").expect("written");
    thread::sleep(Duration::from_millis(200));
    assert!(server.try_wait().expect("it can be asked").is_none());
    TcpStream::connect(&address).expect("it listens");
    drop(input);
    assert_eq!(end(&mut server).code(), Some(0));

    // Without the flag, an input that is closed from the start ends nothing.
    let mut command = Command::new(env!("CARGO_BIN_EXE_nappe-server"));
    command.args(["--address", "127.0.0.1:0", "--no-token"]).stdin(Stdio::null());
    let mut server =
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts");
    self::address(&mut server);
    thread::sleep(Duration::from_millis(200));
    assert!(server.try_wait().expect("it can be asked").is_none());
    terminate(&server);
    assert_eq!(end(&mut server).code(), Some(0));
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

/// The device of Linux that is always full.
#[cfg(target_os = "linux")]
fn full() -> Stdio {
    std::fs::File::options().write(true).open("/dev/full").expect("Linux has one").into()
}

/// A pipe whose reader is gone.
#[cfg(target_os = "linux")]
fn gone() -> Stdio {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    writer.into()
}

#[cfg(target_os = "linux")]
#[test]
fn a_server_whose_log_cannot_be_written_answers_and_ends_with_code_0() {
    for log in [full(), gone()] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_nappe-server"));
        command.args(["--address", "127.0.0.1:0", "--no-token", "--log", "trace"]);
        let mut server = command.stdout(Stdio::piped()).stderr(log).spawn().expect("the program starts");
        let address = address(&mut server);
        drop(deaf(&address));
        terminate(&server);
        assert_eq!(end(&mut server).code(), Some(0));
    }
}

#[cfg(unix)]
#[test]
fn a_log_that_is_no_terminal_has_no_colours_and_holds_its_last_line() {
    let mut server = program(&["--address", "127.0.0.1:0", "--no-token", "--log", "info"]);
    address(&mut server);
    terminate(&server);
    let done = server.wait_with_output().expect("it ends");
    let log = String::from_utf8(done.stderr).expect("a text");
    assert!(log.contains("SIGTERM: draining") && log.trim_end().ends_with("ended"), "{log}");
    assert!(!log.contains('\u{1b}'), "{log:?}");
}

#[cfg(unix)]
#[test]
fn the_address_is_all_that_the_output_says_and_no_link_is_in_it_or_in_the_log() {
    use std::io::{BufRead as _, BufReader};
    let mut server = program(&["--address", "127.0.0.1:0"]);
    let mut output = BufReader::new(server.stdout.take().expect("its output"));
    let (mut first, mut rest) = (String::new(), String::new());
    output.read_line(&mut first).expect("it can be read");
    terminate(&server);
    output.read_to_string(&mut rest).expect("it can be read");
    let done = server.wait_with_output().expect("it ends");
    let log = String::from_utf8(done.stderr).expect("a text");
    assert!(first.starts_with("nappe-server listens on http://") && rest.is_empty(), "{first}{rest}");
    assert!(!first.contains('#') && !log.contains('#'), "{first}{log}");
}

#[cfg(unix)]
#[test]
fn a_number_of_workers_that_tokio_refuses_changes_nothing() {
    for count in ["0", "many"] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_nappe-server"));
        command.args(["--address", "127.0.0.1:0", "--no-token"]).env("TOKIO_WORKER_THREADS", count);
        let mut server =
            command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts");
        address(&mut server);
        terminate(&server);
        assert_eq!(end(&mut server).code(), Some(0), "{count}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_standard_output_that_is_full_is_told_and_ends_with_code_1() {
    for arguments in [&["--help"][..], &["--version"], &["--address", "127.0.0.1:0", "--no-token"]] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_nappe-server"));
        let done = command.args(arguments).stdout(full()).stderr(Stdio::piped()).output().expect("it ends");
        let told = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(1), "{arguments:?}: {told}");
        // A server that listened has told its log so.
        let lines: Vec<&str> = told.lines().filter(|line| !line.contains(" INFO ")).collect();
        let [line] = lines[..] else { panic!("{arguments:?}: {told}") };
        assert!(line.starts_with("nappe-server: cannot write "), "{arguments:?}: {told}");
    }
}

#[test]
fn a_filter_of_the_log_that_cannot_be_read_is_told() {
    let refused = program(&["--log", "nappe_server=loud"]).wait_with_output().expect("it ends");
    let told = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(1), "{told}");
    assert!(told.contains("nappe_server=loud") && told.contains("NAPPE_LOG"), "{told}");
}
