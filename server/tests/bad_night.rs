//! A bad night of the built program, scripted: of each of its events the log has session, reason and caller.

#![cfg(target_os = "linux")]

mod support;
mod logged;

use std::{
    collections::BTreeSet,
    fs::{self, File},
    io::Write as _,
    net::{Ipv4Addr, SocketAddr, TcpStream},
    os::unix::fs::OpenOptionsExt as _,
    thread,
    time::{Duration, Instant},
};

use logged::{Server, call, line_with, send, temporary};
use nappe_proto::v1::{
    CreateSessionRequest, DeleteSessionRequest, GetSessionRequest, PinUpdate, PlaySessionRequest,
    SpringUpdate, StepSessionRequest, StopSessionRequest, UpdateParametersRequest, Vector3,
    WatchFramesRequest, create_session_request::Scene,
};
use nappe_server::Reason;
use prost::Message;
use socket2::{Domain, Socket, Type};

/// Whatever takes this long hangs.
const PATIENCE: Duration = Duration::from_mins(1);
/// The token of the server, and another one.
const TOKENS: [&str; 2] = ["0123456789abcdef", "fedcba9876543210"];

/// A connection from a loopback address that ends in `last`, which takes few bytes that are not read; and that address.
fn connect_from(server: &Server, last: u8) -> (TcpStream, String) {
    let socket = Socket::new(Domain::IPV4, Type::STREAM, None).expect("a socket");
    socket.set_recv_buffer_size(1 << 16).expect("set");
    let own = SocketAddr::from((Ipv4Addr::new(127, 0, 0, last), 0));
    socket.bind(&own.into()).expect("all of 127.0.0.0 is loopback");
    let server: SocketAddr = server.address.parse().expect("an address");
    socket.connect(&server.into()).expect("it listens");
    let line = TcpStream::from(socket);
    let own = line.local_addr().expect("an address").to_string();
    (line, own)
}

/// Waits until the log of a server has a text.
fn until(server: &Server, text: &str) {
    let begin = Instant::now();
    while !fs::read_to_string(&server.log_file).expect("a text").contains(text) {
        assert!(begin.elapsed() < PATIENCE, "the log has no {text}");
        thread::sleep(Duration::from_millis(20));
    }
}

/// Something that happened, and what the log has to say of it.
struct Event {
    what: &'static str,
    reason: Option<Reason>,
    /// Empty if nobody could know which it is.
    session: &'static str,
    caller: String,
}

/// A server and what happened so far. Each event has an address of its own, since the log has a line a second for each
/// reason and address.
struct Night {
    server: Server,
    events: Vec<Event>,
}

impl Night {
    fn caller(&self) -> (TcpStream, String) {
        connect_from(&self.server, 2 + self.events.len() as u8)
    }

    fn note(&mut self, what: &'static str, reason: Option<Reason>, session: &'static str, caller: String) {
        self.events.push(Event { what, reason, session, caller });
    }

    /// A call with a token that is answered, and who made it.
    fn answered(&self, method: &str, message: &impl Message) -> String {
        let (line, caller) = self.caller();
        let head = call(line, method, &bearer(TOKENS[0]), message);
        assert!(head.starts_with("HTTP/1.1 200") && !head.contains("\r\ngrpc-status:"), "{method}: {head}");
        caller
    }

    /// A call with a token that is refused.
    fn refused(&mut self, reason: Reason, session: &'static str, method: &str, message: &impl Message) {
        let (line, caller) = self.caller();
        let head = call(line, method, &bearer(TOKENS[0]), message);
        assert!(head.contains("\r\ngrpc-status: "), "{reason:?}: {head}");
        self.note("refused", Some(reason), session, caller);
    }
}

fn bearer(token: &str) -> String {
    format!("Authorization: Bearer {token}\r\n")
}

/// A session of a sheet, with lines of its own.
fn sheet(id: &str, dt: f64, body: &str) -> CreateSessionRequest {
    of_text(
        id,
        format!(
            "version = 1\ntitle = 'a \"sheet\"'\ndt = {dt}\n\
             [[body]]\nname = \"sheet\"\nmass = {{ density = 0.2 }}\n{body}\n"
        ),
    )
}

fn of_text(id: &str, text: String) -> CreateSessionRequest {
    CreateSessionRequest {
        session_id: id.to_owned(),
        scene: Some(Scene::SceneText(text)),
        thread_count: 1,
        step_limit: Some(0),
        ..CreateSessionRequest::default()
    }
}

/// A sheet of 25 particles that hangs by two corners, with one more line.
fn hanging(more: &str) -> String {
    format!(
        "mesh = {{ grid = [5, 5], spacing = 0.1, ripple = 0.01 }}\npins = [\"top_left\", \"top_right\"]\n{more}\n\
         springs = {{ stretch = {{ stiffness = 50, damping = 0.02 }}, shear = {{ stiffness = 20, damping = 0.01 }} }}"
    )
}

/// Particles without springs, `side` squared.
fn dust(side: u32) -> String {
    format!("mesh = {{ grid = [{side}, {side}], spacing = 0.1 }}\nintegrator = \"symplectic_euler\"")
}

/// Sessions that are asked for and not made, and calls to one that is there, of 25 particles.
fn ask_for_too_much(night: &mut Night) {
    let law = "{ stiffness = 100.0 }";
    let springs = format!("{}\nsprings = {{ stretch = {law}, shear = {law}, bend = {law} }}", dust(1000));
    let unknown = "mesh = { upload = \"never-uploaded\" }";
    let (invalid, missing) = (Reason::InvalidScene, Reason::MeshNotFound);
    for (reason, session, request) in [
        (invalid, "torn", of_text("torn", "version = ".to_owned())),
        (invalid, "odd-key", of_text("odd-key", "version = 1\nwoven_by = 7\n".to_owned())),
        (missing, "no-mesh", sheet("no-mesh", 0.001, unknown)),
        (missing, "no-mesh-either", sheet("no-mesh-either", 0.001, unknown)),
        // Nobody reads which session a message is about that is too large.
        (Reason::MessageTooLarge, "", of_text("long", "#".repeat(3000))),
        (Reason::ServerMemoryFull, "huge", sheet("huge", 0.001, &dust(1000))),
        (Reason::BuildTooLong, "endless", sheet("endless", 0.001, &springs)),
    ] {
        night.refused(reason, session, "CreateSession", &request);
    }

    let pin = PinUpdate { particle: 7, target: Some(Vector3::default()), duration_seconds: 0.1 };
    let update = UpdateParametersRequest { pins: vec![pin], ..UpdateParametersRequest::of("first") };
    night.refused(Reason::InvalidChange, "first", "UpdateParameters", &update);
    let spring = SpringUpdate { body: "nobody".to_owned(), stiffness: Some(1.0), ..SpringUpdate::default() };
    let update = UpdateParametersRequest { springs: vec![spring], ..UpdateParametersRequest::of("first") };
    night.refused(Reason::InvalidChange, "first", "UpdateParameters", &update);
}

/// The server, with limits that its events come to.
fn start() -> Server {
    let token = temporary("night.token");
    let made = File::options().write(true).create(true).truncate(true).mode(0o600).open(&token);
    made.expect("made").write_all(TOKENS[0].as_bytes()).expect("written");
    let path = token.to_str().expect("a text");
    let address = ["--address", "127.0.0.1:0", "--token", path, "--max-sessions", "3"];
    let bytes = ["--max-server-bytes", "150000000", "--history-bytes-per-session", "8000000"];
    let others = ["--max-message-bytes", "2000", "--max-build-seconds", "5", "--watcher-stall-seconds", "1"];
    let server = Server::start("night", &[&address[..], &bytes, &others].concat());
    fs::remove_file(token).expect("removed");
    server
}

/// Finds the line of each event.
fn check(events: &[Event], log: &str) {
    let kinds: BTreeSet<_> = events.iter().map(|event| (event.what, event.reason)).collect();
    assert_eq!((events.len(), kinds.len()), (20, 12));
    for Event { what, reason, session, caller } in events {
        let mut words = vec![" INFO ".to_owned(), format!(": {what} "), format!("caller={caller}")];
        words.extend(reason.map(|reason| format!("reason=\"{}\"", reason.name())));
        words.extend((!session.is_empty()).then(|| format!("session=\"{session}\"")));
        let line = line_with(log, &words.iter().map(String::as_str).collect::<Vec<_>>());
        assert!(!session.is_empty() || !line.contains("session="), "{line}");
    }
}

#[test]
fn of_a_bad_night_the_log_has_every_event_with_its_session_reason_and_caller() {
    let mut night = Night { server: start(), events: Vec::new() };
    for _ in 0..2 {
        let (line, caller) = night.caller();
        let head = call(line, "GetSession", &bearer(TOKENS[1]), &GetSessionRequest::of("first"));
        assert!(head.contains("grpc-status: 16"), "{head}");
        night.note("refused", Some(Reason::TokenWrong), "", caller);
    }
    let missing = Reason::SessionNotFound;
    night.refused(missing, "nobody", "GetSession", &GetSessionRequest::of("nobody"));
    night.refused(missing, "nobody-else", "PlaySession", &PlaySessionRequest::of("nobody-else"));
    night.refused(missing, "nobody-at-all", "DeleteSession", &DeleteSessionRequest::of("nobody-at-all"));

    let maker = night.answered("CreateSession", &sheet("first", 0.002, &hanging("drag = 1e-4")));
    ask_for_too_much(&mut night);

    night.answered("CreateSession", &sheet("watched", 0.001, &dust(200)));
    let diverges = hanging("integrator = \"explicit_euler\"\nunchecked = true");
    night.answered("CreateSession", &sheet("wild", 0.5, &diverges));
    for id in ["fourth", "fifth"] {
        night.refused(Reason::TooManySessions, id, "CreateSession", &sheet(id, 0.001, &dust(5)));
    }
    let step = StepSessionRequest { step_count: 100_000, wait: true, ..StepSessionRequest::of("wild") };
    night.refused(Reason::NotFinite, "wild", "StepSession", &step);

    let (mut watcher, caller) = night.caller();
    send(&mut watcher, "WatchFrames", &bearer(TOKENS[0]), &WatchFramesRequest::of("watched"));
    night.note("watcher cut", Some(Reason::WatcherStalled), "watched", caller.clone());
    night.answered("PlaySession", &PlaySessionRequest::of("watched"));
    for text in ["watcher cut", "a connection is cut"] {
        until(&night.server, text);
    }
    drop(watcher);
    night.answered("StopSession", &StopSessionRequest::of("watched"));
    for id in ["watched", "first"] {
        let deleter = night.answered("DeleteSession", &DeleteSessionRequest::of(id));
        night.note("deleted", None, id, deleter);
    }

    let Night { server, events } = night;
    let address = format!("address={} ", server.address);
    let log = server.log();
    check(&events, &log);
    let [maker, watcher] = [maker, caller].map(|caller| format!("caller={caller} "));
    let title = "title=\"a \\\"sheet\\\"\"";
    for words in [
        &["started", "version=\"", &address, "memory=150000000", "launcher=\"", "max_sessions: 3"][..],
        &["created", "session=\"first\"", &maker, "particles=25 bytes=", "ranks=0", title],
        &["a connection is cut", "session=\"watched\"", &watcher, "bytes="],
        &[" WARN ", "failed", "session=\"wild\"", "reason=\"NOT_FINITE\""],
        &["finished", "session=\"watched\"", "step="],
        &["deleted, since the server ends", "session=\"wild\""],
    ] {
        line_with(&log, words);
    }
    for secret in TOKENS.into_iter().chain(["woven_by", "ripple", "never-uploaded"]) {
        assert!(!log.contains(secret), "{secret} is in the log: {log}");
    }
}
