//! The built program `nappe-viewer`, from outside.

#![cfg(unix)]

use std::{
    collections::BTreeSet,
    path::Path,
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use nappe_client::{Client, CreateSession};
use nappe_server::{App, Config};

/// Waits until something is so, for a minute at most.
fn until(what: &str, mut is_so: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !is_so() {
        assert!(begin.elapsed() < Duration::from_mins(1), "not within a minute: {what}");
        thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_recording_is_closed_properly_when_the_program_is_asked_to_end() {
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let address = "127.0.0.1:0".parse().expect("an address");
    let (app, id) = runtime.block_on(async {
        let patient = Config { handshake_seconds: 300.0, request_seconds: 300.0, ..Config::default() };
        let app = App::start(Config { address, ..patient }).expect("the server starts");
        let client = Client::connect(&app.url()).await.expect("connected");
        let wanted = CreateSession { step_limit: Some(0), ..CreateSession::named("demo") };
        let id = client.create_session(wanted).await.expect("made").session.session_id;
        client.play(&id, 1.0).await.expect("it plays");
        (app, id)
    });

    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("asked-to-end.rrd");
    // One of an earlier run, if there is one.
    let _ = std::fs::remove_file(&file);
    let mut viewer = Command::new(env!("CARGO_BIN_EXE_nappe-viewer"));
    viewer.args(["--server", &app.url(), "--session", &id, "--save"]).arg(&file).stderr(Stdio::piped());
    let mut viewer = viewer.spawn().expect("it starts");

    // What the file grows by, again and again, is frames: they are all that comes after the topology.
    let mut sizes = BTreeSet::new();
    until("frames are written", || {
        sizes.insert(std::fs::metadata(&file).map_or(0, |file| file.len()));
        sizes.len() > 10
    });
    let sent = Command::new("kill").args(["-TERM", &viewer.id().to_string()]).status();
    assert!(sent.expect("the signal is sent").success());

    until("the end of the viewer", || viewer.try_wait().expect("it can be asked").is_some());
    let done = viewer.wait_with_output().expect("it ends");
    let told = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(0), "it closed its recording: {told}");
    let frames = told.split(" frames shown").next().and_then(|before| before.rsplit('\n').next());
    let frames: u64 = frames.and_then(|count| count.trim().parse().ok()).expect("a number of frames");
    assert!(frames > 0 && told.contains("stopped"), "{told}");
    assert!(std::fs::metadata(&file).expect("the recording").len() > 0);
    runtime.block_on(app.shutdown());
}
