//! What happens when connections break and when a program is asked to end: twice.

use std::{
    io::{self, Read as _, Write as _},
    net::{Shutdown, TcpListener, TcpStream},
    process::Stdio,
    sync::mpsc,
    thread,
};

use serde_json::Value;

use crate::support::{Lines, PATIENCE, SMALL_SCENE, Server, command, end_by, folder, until, write_scene};

/// Opens HTTP/2, where streams may be sent no bytes unasked, and makes a call: its answer never ends, and such a
/// connection lasts as long as a drain may. Returns once the headers of the answer have come.
fn deaf(address: &str) -> TcpStream {
    const OPENING: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
    const SETTINGS: &[u8] = &[0, 0, 6, 4, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0, 0];
    /// An empty message, the last of its stream.
    const MESSAGE: &[u8] = &[0, 0, 5, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0];
    const HEADERS: u8 = 1;

    let mut block = Vec::new();
    for (name, value) in [
        (":method", "POST"),
        (":scheme", "http"),
        (":authority", "localhost"),
        (":path", "/nappe.v1.SimulationService/GetServerInfo"),
        ("content-type", "application/grpc"),
        ("te", "trailers"),
    ] {
        // Written out, and not for the table.
        block.push(0);
        for text in [name, value] {
            block.push(text.len() as u8);
            block.extend(text.bytes());
        }
    }
    let head = [0, 0, block.len() as u8, HEADERS, 4, 0, 0, 0, 1];

    let mut stream = TcpStream::connect(address).expect("accepted");
    stream.set_read_timeout(Some(PATIENCE)).expect("set");
    stream.write_all(&[OPENING, SETTINGS, &head, &block, MESSAGE].concat()).expect("sent");
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

/// A session of the small scene that never ends by itself.
fn endless(server: &Server) {
    let folder = folder();
    let scene = write_scene(folder.path(), &SMALL_SCENE.replace("steps = 40", "steps = 0"));
    server.nappe(&["create", &scene, "--id", "endless"]).ok();
}

#[test]
fn a_second_signal_ends_a_server_at_once() {
    let server = Server::with(&["--no-token", "--drain-seconds", "300", "--drain-stall-seconds", "300"]);
    let address = server.url.trim_start_matches("http://").to_owned();
    let deaf = deaf(&address);

    server.signal("TERM");
    until("it no longer listens", || TcpStream::connect(&address).is_err());
    assert_eq!(server.end_by("TERM"), Some(130));
    drop(deaf);
}

#[test]
fn watching_goes_on_after_the_connection_broke() {
    let server = Server::start();
    endless(&server);
    let (url, cut) = proxy(server.url.trim_start_matches("http://"));

    let mut watching = command();
    watching.args(["watch", "endless", "--rate", "20", "--count", "40", "--json", "--server", &url]);
    // The port is the proxy's, and no server has left a token for it.
    watching.args(["--token", server.token_file.as_deref().expect("it says where its token is")]);
    let mut watching = watching.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    let lines = Lines::of(watching.stdout.take().expect("a pipe"));
    let told = Lines::of(watching.stderr.take().expect("a pipe"));

    // The session stands, so that no more comes before the connection breaks and is back.
    lines.next().expect("how it stands");
    cut.send(()).expect("the proxy runs");
    told.with("is back");
    server.nappe(&["play", "endless", "--real-time-factor", "1"]).ok();
    assert_eq!(1 + lines.rest().len(), 40);
    assert_eq!(watching.wait().expect("it has ended").code(), Some(0), "{:?}", told.rest());
}

#[test]
fn a_server_that_died_is_named_before_progress_is_told_again_and_again() {
    let folder = folder();
    let scene = write_scene(folder.path(), &SMALL_SCENE.replace("steps = 40", "steps = 0"));
    let frames = folder.path().join("frames");
    let frames = frames.to_str().expect("UTF-8");
    let verbs: [&[&str]; 4] = [
        &["run", &scene],
        &["run", &scene, "--save", frames],
        &["watch", "endless"],
        &["watch", "endless", "--save", frames, "--force"],
    ];
    for words in verbs {
        let server = Server::start();
        endless(&server);
        server.nappe(&["play", "endless", "--real-time-factor", "1"]).ok();
        let url = server.url.clone();
        let mut process = command();
        process.args(words).args(["--server", &url]).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut process = process.spawn().expect("it starts");
        let told = Lines::of(process.stderr.take().expect("a pipe"));
        until("every session is watched", || {
            let sessions = server.nappe(&["list"]).ok().json();
            let sessions = sessions.as_array().expect("an array").clone();
            let wanted = if words[0] == "run" { 2 } else { 1 };
            let is_watched = |session: &Value| session["watcher_count"] == 1 && session["state"] == "playing";
            sessions.len() == wanted && sessions.iter().any(is_watched)
        });

        server.end_by("KILL");
        let broke = told.with("is asked for again");
        assert!(broke.contains(&url), "{broke}");
        let last = told.rest();
        let gone = format!("no server answers at {url}");
        assert!(last.iter().any(|line| line.contains(&gone)), "{words:?}: {last:?}");
        // A line comes every 10 s: attempts for 19 s had one or two.
        let progress = last.iter().filter(|line| line.starts_with("nappe: step")).count();
        assert!(progress <= 1, "{words:?}: {last:?}");
        assert_eq!(process.wait().expect("it has ended").code(), Some(4), "{words:?}: {last:?}");
    }
}

/// A proxy in a thread, whose first connection is cut when asked to.
fn proxy(server: &str) -> (String, mpsc::Sender<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let url = format!("http://{}", listener.local_addr().expect("an address"));
    let (cut, asked) = mpsc::channel();
    let server = server.to_owned();
    let mut asked = Some(asked);
    thread::spawn(move || {
        for inner in listener.incoming() {
            let (inner, outer) = (inner.expect("accepted"), TcpStream::connect(&server).expect("it listens"));
            for (from, to) in [(&inner, &outer), (&outer, &inner)] {
                let (mut from, mut to) = (from.try_clone().expect("a copy"), to.try_clone().expect("a copy"));
                thread::spawn(move || io::copy(&mut from, &mut to));
            }
            if let Some(asked) = asked.take() {
                thread::spawn(move || {
                    if asked.recv().is_ok() {
                        for end in [inner, outer] {
                            // Whoever was quicker has closed it already.
                            let _ = end.shutdown(Shutdown::Both);
                        }
                    }
                });
            }
        }
    });
    (url, cut)
}

#[test]
fn steps_that_take_long_are_waited_for_and_that_is_said() {
    let server = Server::start();
    endless(&server);
    let mut stepping = command();
    stepping.args(["step", "endless", "10000000", "--server", &server.url]);
    let mut stepping = stepping.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts");
    let stderr = Lines::of(stepping.stderr.take().expect("its standard error is a pipe"));
    let said = stderr.next().expect("it says something");
    assert!(said.contains("still stepping") && said.contains("endless"), "{said}");
    // A shell in the background has its children ignore the other signal.
    end_by(&mut stepping, "TERM");
}
