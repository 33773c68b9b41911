//! What happens when connections break and when a program is asked to end: twice, or beside a viewer that is gone.

use std::{
    io::{self, BufRead as _, BufReader, Write as _},
    net::{Shutdown, TcpListener, TcpStream},
    process::Stdio,
    sync::mpsc,
    thread,
    time::Duration,
};

use crate::support::{SMALL_SCENE, Server, command, end_by, folder, write_scene};

/// Opens HTTP/2 and answers nothing after it: such a connection lasts as long as a drain may.
const OPENING: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0";

/// A session of the small scene that never ends by itself.
fn endless(server: &Server) {
    let folder = folder();
    let scene = write_scene(folder.path(), &SMALL_SCENE.replace("steps = 40", "steps = 0"));
    server.nappe(&["create", &scene, "--id", "endless"]).ok();
}

#[test]
fn a_second_signal_ends_a_server_at_once() {
    let server = Server::with(&["--drain-seconds", "300"]);
    let mut deaf = TcpStream::connect(server.url.trim_start_matches("http://")).expect("accepted");
    deaf.write_all(OPENING).expect("sent");
    thread::sleep(Duration::from_millis(300));

    server.signal("TERM");
    thread::sleep(Duration::from_millis(500));
    assert_eq!(server.end_by("TERM"), Some(130));
}

#[test]
fn watching_goes_on_after_the_connection_broke() {
    let server = Server::start();
    endless(&server);
    server.nappe(&["play", "endless", "--real-time-factor", "1"]).ok();
    let (url, cut) = proxy(server.url.trim_start_matches("http://"));

    let mut watching = command();
    watching.args(["watch", "endless", "--rate", "20", "--count", "40", "--json", "--server", &url]);
    // The port is the proxy's, and no server has left a token for it.
    watching.args(["--token", server.token_file.as_deref().expect("it says where its token is")]);
    let watching = watching.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    thread::sleep(Duration::from_secs(1));
    cut.send(()).expect("the proxy runs");
    let done = watching.wait_with_output().expect("it ends");
    let told = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(0), "{told}");
    assert!(told.contains("is back"), "{told}");
    assert_eq!(String::from_utf8_lossy(&done.stdout).lines().count(), 40);
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
    let mut said = String::new();
    let stderr = stepping.stderr.take().expect("its standard error is a pipe");
    BufReader::new(stderr).read_line(&mut said).expect("it says something");
    assert!(said.contains("still stepping") && said.contains("endless"), "{said}");
    // A shell in the background has its children ignore the other signal.
    end_by(&mut stepping, "TERM");
}

#[test]
#[cfg(feature = "rerun")]
fn a_server_outlives_what_shows_its_sessions() {
    // Nobody may connect, so that the first call of the viewer's side fails already.
    let viewer = "rerun+http://127.0.0.1:1/proxy";
    let server = Server::with(&["--rerun", viewer, "--max-connections", "0"]);
    thread::sleep(Duration::from_millis(1500));
    let code = server.end_by("TERM");
    assert_eq!(code, Some(0), "it ran until it was asked to end");
}
