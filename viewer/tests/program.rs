//! The built program `nappe-viewer`, from outside.

#![cfg(unix)]

use std::{
    path::Path,
    process::{Command, Stdio},
    thread,
    time::Duration,
};

use nappe_client::{Client, CreateSession};
use nappe_server::{App, Config};

#[test]
fn a_recording_is_closed_properly_when_the_program_is_asked_to_end() {
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let address = "127.0.0.1:0".parse().expect("an address");
    let (app, id) = runtime.block_on(async {
        let app = App::start(Config { address, ..Config::default() }).expect("the server starts");
        let client = Client::connect(&app.url()).await.expect("connected");
        let wanted = CreateSession { step_limit: Some(0), ..CreateSession::named("demo") };
        let id = client.create_session(wanted).await.expect("made").session.session_id;
        client.play(&id, 1.0).await.expect("it plays");
        (app, id)
    });

    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("asked-to-end.rrd");
    let mut viewer = Command::new(env!("CARGO_BIN_EXE_nappe-viewer"));
    viewer.args(["--server", &app.url(), "--session", &id, "--save"]).arg(&file).stderr(Stdio::piped());
    let viewer = viewer.spawn().expect("it starts");
    thread::sleep(Duration::from_secs(2));
    let sent = Command::new("kill").args(["-TERM", &viewer.id().to_string()]).status();
    assert!(sent.expect("the signal is sent").success());

    let done = viewer.wait_with_output().expect("it ends");
    let told = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(0), "it closed its recording: {told}");
    let frames = told.split(" frames shown").next().and_then(|before| before.rsplit('\n').next());
    let frames: u64 = frames.and_then(|count| count.trim().parse().ok()).expect("a number of frames");
    assert!(frames > 0 && told.contains("stopped"), "{told}");
    assert!(std::fs::metadata(&file).expect("the recording").len() > 0);
    runtime.block_on(app.shutdown());
}
