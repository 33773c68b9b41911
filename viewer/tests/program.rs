//! The built program `nappe-viewer`, from outside.

#![cfg(unix)]

use std::{
    collections::BTreeSet,
    io::Write as _,
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use nappe_client::{Client, CreateSession};
use nappe_server::{App, Config, TokenPlace};
use serde_json::Value;

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

/// A server that asks for a token that only this process knows, and a session of `steps` steps on it, at its start.
async fn guarded(steps: u64) -> (App, Client, String) {
    let patient = Config { handshake_seconds: 300.0, request_seconds: 300.0, ..Config::default() };
    let address = "127.0.0.1:0".parse().expect("an address");
    let config = Config { address, token_place: TokenPlace::Memory, ..patient };
    let app = App::start(config).expect("the server starts");
    let token = app.token().expect("it asks for a token");
    let client = Client::connect_with(&app.url(), token).await.expect("connected");
    let wanted = CreateSession { step_limit: Some(steps), ..CreateSession::named("demo") };
    let id = client.create_session(wanted).await.expect("made").session.session_id;
    (app, client, id)
}

/// The program with these options, which was told the token on its standard input.
fn told(app: &App, options: &[&str]) -> Child {
    started(Command::new(env!("CARGO_BIN_EXE_nappe-viewer")), app, options)
}

/// The same, started by a command that ends where its options begin.
fn started(mut viewer: Command, app: &App, options: &[&str]) -> Child {
    viewer.args(["--server", &app.url(), "--token", "-", "--json"]).args(options);
    viewer.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut viewer = viewer.spawn().expect("it starts");
    let token = app.token().expect("it asks for a token").reveal().to_owned();
    writeln!(viewer.stdin.as_mut().expect("a pipe"), "{token}").expect("it listens");
    viewer
}

/// The last line of standard output, and the exit code.
fn last(viewer: Child) -> (Option<i32>, Value) {
    let done = viewer.wait_with_output().expect("it ends");
    let text = String::from_utf8_lossy(&done.stdout).into_owned();
    let line = text.lines().last().unwrap_or_default();
    let value = serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {done:?}"));
    (done.status.code(), value)
}

#[test]
fn a_session_waits_for_its_recording_which_has_every_frame_and_says_so_in_json() {
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let (app, client, id) = runtime.block_on(guarded(40));
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("paced.rrd");
    let path = file.to_str().expect("a UTF-8 path");
    let viewer = told(&app, &["--session", &id, "--paced", "--save", path]);
    let session = || runtime.block_on(client.get_session(&id)).expect("it is there");
    until("it is watched", || session().watcher_count == 1);
    runtime.block_on(client.play(&id, 0.0)).expect("it plays");

    let (code, said) = last(viewer);
    assert_eq!(code, Some(0), "{said}");
    assert_eq!((&said["frames"], &said["dropped"]), (&(session().frame + 1).into(), &0.into()), "{said}");
    assert_eq!((&said["finished"], &said["saved"]), (&true.into(), &path.into()), "{said}");
    runtime.block_on(app.shutdown());
}

#[test]
fn it_ends_with_its_input_and_closes_the_recording() {
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let (app, client, id) = runtime.block_on(guarded(0));
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("until-closed.rrd");
    let path = file.to_str().expect("a UTF-8 path");
    let mut viewer = told(&app, &["--session", &id, "--save", path, "--until-stdin-closes"]);
    let session = || runtime.block_on(client.get_session(&id)).expect("it is there");
    until("it is watched", || session().watcher_count == 1);
    drop(viewer.stdin.take());
    let (code, said) = last(viewer);
    assert_eq!((code, &said["finished"]), (Some(0), &false.into()), "{said}");

    let every = told(
        &app,
        &["--every-session", "--connect", "rerun+http://127.0.0.1:1/proxy", "--until-stdin-closes"],
    );
    let done = every.wait_with_output().expect("its input is closed, so it ends");
    assert_eq!(done.status.code(), Some(0), "{done:?}");
    runtime.block_on(app.shutdown());
}

#[test]
fn a_failure_has_the_exit_code_of_the_command_and_the_reason_of_the_server() {
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let (app, _client, id) = runtime.block_on(guarded(4));
    let (code, said) = last(told(&app, &["--session", "nobody-here"]));
    assert_eq!((code, &said["reason"]), (Some(5), &"SESSION_NOT_FOUND".into()), "{said}");
    let nowhere = ["--session", &id, "--save", "/nowhere/at/all.rrd"];
    let (code, said) = last(told(&app, &nowhere));
    assert_eq!((code, &said["reason"]), (Some(1), &Value::Null), "{said}");
    assert!(said["error"].as_str().is_some_and(|error| error.contains("/nowhere/at/all.rrd")), "{said}");
    let output = Command::new(env!("CARGO_BIN_EXE_nappe-viewer"))
        .args(["--session", &id, "--token", "-"])
        .stdin(Stdio::null())
        .output()
        .expect("it runs");
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    runtime.block_on(app.shutdown());
}

#[test]
fn a_file_that_takes_no_more_is_named_with_the_cause_and_its_frames() {
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let (app, client, id) = runtime.block_on(guarded(40));
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("full.rrd");
    // One of an earlier run, if there is one.
    let _ = std::fs::remove_file(&file);
    let path = file.to_str().expect("a UTF-8 path");
    // A file of some kilobytes is as large as it may be, as on a full disk.
    let mut limited = Command::new("sh");
    limited.args([
        "-c",
        "trap '' XFSZ; ulimit -f 32; exec \"$0\" \"$@\"",
        env!("CARGO_BIN_EXE_nappe-viewer"),
    ]);
    let viewer = started(limited, &app, &["--session", &id, "--paced", "--save", path]);
    let session = || runtime.block_on(client.get_session(&id)).expect("it is there");
    until("it is watched", || session().watcher_count == 1);
    runtime.block_on(client.play(&id, 0.0)).expect("it plays");

    let (code, said) = last(viewer);
    let error = said["error"].as_str().unwrap_or_default();
    let parts = [path, "File too large", " frames that came, the first "];
    assert!(code == Some(1) && parts.iter().all(|part| error.contains(part)), "{said}");
    runtime.block_on(app.shutdown());
}
