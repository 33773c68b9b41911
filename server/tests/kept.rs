//! Sessions that outlive the built program: it is killed, and started again, and has its sessions, with the bits of an undisturbed run.

#![cfg(target_os = "linux")]

mod support;
mod kept_server;

use std::{
    fs,
    io::Read as _,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use kept_server::{Server, folder, in_time, request};
use nappe_proto::v1::{self, SessionState};
use tonic::Request;
use xxhash_rust::xxh3::xxh3_64;

/// The names of the files of a kind that a folder has of its only session, the newest last.
fn files(folder: &Path, kind: &str) -> Vec<PathBuf> {
    let mut session = fs::read_dir(folder.join("sessions")).expect("a folder");
    let session = session.next().expect("a session").expect("an entry").path();
    let number = |path: &PathBuf| -> u64 {
        let name = path.file_name().and_then(|name| name.to_str()).expect("a text");
        name.split('-').nth(1).expect("a number").parse().expect("a number")
    };
    let paths = fs::read_dir(session).expect("a folder").map(|entry| entry.expect("an entry").path());
    let has_kind = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str()).expect("a text");
        name.split('-').next() == Some(kind) && path.extension().is_none()
    };
    let mut paths: Vec<PathBuf> = paths.filter(has_kind).collect();
    paths.sort_by_key(number);
    paths
}

/// Calls that change a session, from its start to step 37: a pin on its way, a force, wind that waits, and a reset.
async fn change(server: &mut Server, id: &str) {
    server.step(id, 12).await;
    let force = Some([0.0, 0.01, 0.0].into());
    let forces = ["sheet", "ball"];
    let forces = forces.map(|body| v1::ForceUpdate { body: body.into(), force, ..Default::default() });
    let pins =
        vec![v1::PinUpdate { particle: 0, target: Some([0.0, 0.1, 0.02].into()), duration_seconds: 0.3 }];
    let calls =
        v1::UpdateParametersRequest { forces: forces.to_vec(), pins, ..v1::UpdateParametersRequest::of(id) };
    server.client.update_parameters(calls).await.expect("accepted");
    server.step(id, 8).await;
    server.reset(id).await;
    let gravity = Some([0.0, -5.0, 0.5].into());
    for (at_step, drag) in [(30, 0.01), (50, 0.02), (60, 0.03)] {
        let update = v1::UpdateParametersRequest::of(id);
        let update = v1::UpdateParametersRequest { at_step, gravity, drag: Some(drag), ..update };
        let answer = server.client.update_parameters(update).await.expect("accepted").into_inner();
        if at_step == 60 {
            let drop = v1::DropPendingChangesRequest::of(id);
            let drop = v1::DropPendingChangesRequest { orders: vec![answer.order], ..drop };
            server.client.drop_pending_changes(drop).await.expect("dropped");
        }
    }
    server.step(id, 17).await;
}

#[tokio::test]
async fn a_program_that_was_killed_has_its_sessions_again_with_all_that_was_answered() {
    let (folder, mut reference) = (folder("killed"), Server::start(None, &["--no-token"]).await);
    let precisions = [("narrow", v1::Precision::F32), ("wide", v1::Precision::F64)];
    // A state at the start alone, and many of them: what was answered is in the log, or in a state.
    for seconds in ["3600", "0"] {
        let options = ["--no-token", "--checkpoint-seconds", seconds];
        let mut server = Server::start(Some(&folder), &options).await;
        let mut made = Vec::new();
        for (id, precision) in precisions {
            made.push(server.create(id, precision).await);
            reference.create(id, precision).await;
            change(&mut server, id).await;
            change(&mut reference, id).await;
        }
        server.kill();

        let mut server = Server::start(Some(&folder), &options).await;
        for (before, (id, _)) in made.iter().zip(precisions) {
            let expected = reference.get(id).await;
            assert_eq!(expected.durability, None, "a server without a folder keeps nothing");
            let again = server.until(id, |session| session.step == 37 && session.state_hash.is_some()).await;
            let durability = again.durability.as_ref().expect("it is kept");
            assert!(durability.step.is_some_and(|step| step <= 37) && durability.problem.is_empty());
            assert_eq!((&again.uid, &again.create_time), (&before.uid, &before.create_time));
            assert_eq!((again.frame, again.state()), (expected.frame, SessionState::Paused), "{id}");
            assert_eq!(again.state_hash, expected.state_hash, "{id} at once, states every {seconds} s");
            let orders = [server.pending(id).await, reference.pending(id).await];
            assert_eq!(orders, [vec![4_u64], vec![4]], "one call waits");

            let (again, expected) = (server.step(id, 40).await, reference.step(id, 40).await);
            assert_eq!(again.state_hash, expected.state_hash, "{id} 40 steps later");
            for server in [&mut server, &mut reference] {
                server.reset(id).await;
            }
            let (again, expected) = (server.step(id, 5).await, reference.step(id, 5).await);
            assert_eq!(again.state_hash, expected.state_hash, "{id} after another reset");
            assert_eq!(again.frame, expected.frame);
            for server in [&mut server, &mut reference] {
                server.delete(id).await;
            }
        }
        server.kill();
        let mut server = Server::start(Some(&folder), &options).await;
        assert!(server.list().await.is_empty(), "sessions that were deleted are gone");
        drop(server);
        assert_eq!(fs::read_dir(folder.join("sessions")).expect("a folder").count(), 0);
        assert_eq!(fs::read_dir(folder.join("setups")).expect("a folder").count(), 0);
    }
    fs::remove_dir_all(folder).expect("removed");
}

#[tokio::test]
async fn a_session_that_played_plays_on_and_no_frame_number_goes_back() {
    let folder = folder("played");
    let options = ["--no-token", "--checkpoint-seconds", "0.05"];
    let mut server = Server::start(Some(&folder), &options).await;
    server.create("playing", v1::Precision::F32).await;
    let play = v1::PlaySessionRequest { real_time_factor: 0.5, ..v1::PlaySessionRequest::of("playing") };
    server.client.play_session(play).await.expect("it plays");
    let mut changes = Vec::new();
    for round in 0..4_u32 {
        let update = v1::UpdateParametersRequest::of("playing");
        let gravity = [0.0, -f64::from(round), 0.0];
        let update = v1::UpdateParametersRequest { gravity: Some(gravity.into()), wait: true, ..update };
        let answer = in_time(server.client.update_parameters(update)).await.expect("accepted").into_inner();
        changes.push((answer.effective_step, gravity));
        let seen = server.get("playing").await;
        server.until("playing", |session| session.frame > seen.frame).await;
        let last = server.newest_frame("playing").await;
        server.kill();

        server = Server::start(Some(&folder), &options).await;
        let first = server.newest_frame("playing").await;
        assert!(first >= last, "frame {first} is shown after frame {last}");
        let session = server.until("playing", |session| session.frame > last).await;
        assert_eq!(session.state(), SessionState::Playing);
    }
    // No step is in progress that a stop could give up.
    let pause = v1::PauseSessionRequest { wait: true, ..v1::PauseSessionRequest::of("playing") };
    in_time(server.client.pause_session(pause)).await.expect("paused");
    let stopped = v1::StopSessionRequest::of("playing");
    let stopped = in_time(server.client.stop_session(stopped)).await.expect("stopped").into_inner();
    let stopped = stopped.session.expect("the answer has the session");
    server.kill();

    // It is as it ended, and has the bits of a session that nobody disturbed.
    let mut server = Server::start(Some(&folder), &options).await;
    let ended = |session: &v1::Session| session.state() == SessionState::Finished;
    let again = server.until("playing", ended).await;
    assert_eq!((again.step, again.frame), (stopped.step, stopped.frame));
    assert_eq!(again.state_hash, stopped.state_hash);
    server.create("undisturbed", v1::Precision::F32).await;
    for (at_step, gravity) in changes {
        let update = v1::UpdateParametersRequest::of("undisturbed");
        let update = v1::UpdateParametersRequest { at_step, gravity: Some(gravity.into()), ..update };
        server.client.update_parameters(update).await.expect("accepted");
    }
    let undisturbed = server.step("undisturbed", stopped.step).await;
    assert_eq!(undisturbed.state_hash, stopped.state_hash);
    drop(server);
    fs::remove_dir_all(folder).expect("removed");
}

#[tokio::test]
async fn calls_that_come_while_steps_are_done_again_follow_all_that_somebody_knows_of() {
    /// The last frame is of the step before.
    const STEPS: u64 = 301;
    let (folder, mut reference) = (folder("again"), Server::start(None, &["--no-token"]).await);
    let options = ["--no-token", "--checkpoint-seconds", "3600"];
    let mut server = Server::start(Some(&folder), &options).await;
    let gravity = |id: &str, y: f64| v1::UpdateParametersRequest {
        gravity: Some([0.0, y, 0.0].into()),
        ..v1::UpdateParametersRequest::of(id)
    };
    for server in [&mut server, &mut reference] {
        for id in ["changed", "copied", "stopped"] {
            server.create(id, v1::Precision::F32).await;
            server.step(id, 7).await;
            server.client.update_parameters(gravity(id, -2.0)).await.expect("accepted");
            server.step(id, STEPS - 7).await;
        }
    }
    server.kill();

    // Nobody waits until all is as it was.
    let mut server = Server::start(Some(&folder), &options).await;
    let mut hashes = Vec::new();
    for server in [&mut server, &mut reference] {
        assert!(server.pending("changed").await.is_empty(), "the change was made");
        let request = v1::DropPendingChangesRequest::of("changed");
        let dropped = server.client.drop_pending_changes(request).await.expect("an answer").into_inner();
        assert_eq!(dropped.dropped_count, 0);
        let changed = server.client.update_parameters(gravity("changed", -5.0)).await;
        assert_eq!(changed.expect("accepted").into_inner().effective_step, STEPS);
        let stop = in_time(server.client.stop_session(v1::StopSessionRequest::of("stopped"))).await;
        let stopped = stop.expect("stopped").into_inner().session.expect("the answer has the session");
        let fork =
            v1::ForkSessionRequest { new_session_id: "copy".into(), ..v1::ForkSessionRequest::of("copied") };
        let fork = in_time(server.client.fork_session(fork)).await.expect("forked");
        let copy = fork.into_inner().session.expect("the answer has the session");
        assert_eq!([stopped.step, copy.step], [STEPS; 2]);
        let changed = server.step("changed", 20).await;
        assert_eq!(changed.step, STEPS + 20);
        hashes.push([stopped, copy, changed].map(|session| (session.frame, session.state_hash)));
    }
    assert_eq!(hashes[0], hashes[1]);
    drop(server);
    fs::remove_dir_all(folder).expect("removed");
}

#[tokio::test]
async fn a_program_that_is_told_to_end_leaves_a_state_of_the_last_step() {
    let folder = folder("told");
    let options = ["--no-token", "--checkpoint-seconds", "3600"];
    let mut server = Server::start(Some(&folder), &options).await;
    server.create("told", v1::Precision::F32).await;
    let play = v1::PlaySessionRequest::of("told");
    server.client.play_session(play).await.expect("it plays");
    server.until("told", |session| session.step > 5).await;
    server.end();
    let states = files(&folder, "state");
    assert_eq!(states.len(), 2, "{states:?}: the start and the end");

    let name = states[1].file_name().and_then(|name| name.to_str()).expect("a text");
    let step: u64 = name.rsplit('-').next().expect("a step").parse().expect("a number");
    assert!(step > 5, "{name}");
    let mut server = Server::start(Some(&folder), &options).await;
    let session = server.until("told", |session| session.step > step).await;
    assert_eq!(session.state(), SessionState::Playing);
    drop(server);
    fs::remove_dir_all(folder).expect("removed");
}

#[tokio::test]
async fn of_a_state_or_a_log_that_is_damaged_what_was_before_is_used() {
    let folder = folder("damaged");
    let options = ["--no-token", "--checkpoint-seconds", "3600"];
    let mut server = Server::start(Some(&folder), &options).await;
    server.create("one", v1::Precision::F32).await;
    server.step("one", 10).await;
    server.end();
    let mut server = Server::start(Some(&folder), &options).await;
    let expected = server.step("one", 10).await;
    server.kill();

    // Of the states at steps 0 and 10 the later one is altered: all is done again since the start.
    let states = files(&folder, "state");
    assert_eq!(states.len(), 2, "{states:?}");
    let mut bytes = fs::read(&states[1]).expect("read");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(&states[1], &bytes).expect("written");
    let mut server = Server::start(Some(&folder), &options).await;
    let again = server.until("one", |session| session.step == 20 && session.state_hash.is_some()).await;
    assert_eq!(again.state_hash, expected.state_hash);
    assert_eq!(files(&folder, "state"), states[..1], "the damaged one counts no longer");
    assert_eq!(files(&folder, "damaged").len(), 1, "and stays there");
    let log = server.kill();
    assert!(log.contains("is not taken: section '"), "{log}");

    // Of the last log the last bytes are cut off, as when the power fails: what was before is there.
    let logs = files(&folder, "log");
    let last = logs.iter().rfind(|log| fs::metadata(log).expect("there").len() > 40).expect("a log of steps");
    let length = fs::metadata(last).expect("there").len();
    let file = fs::OpenOptions::new().write(true).open(last).expect("opened");
    file.set_len(length - 3).expect("cut");
    let mut server = Server::start(Some(&folder), &options).await;
    let cut = server.get("one").await;
    assert!(cut.step <= 20 && cut.uid == expected.uid);
    let stepped = server.step("one", 30).await;
    let log = server.kill();
    assert!(log.contains("what follows is dropped"), "{log}");

    // What was done since stays, too.
    let mut server = Server::start(Some(&folder), &options).await;
    let wanted = |session: &v1::Session| session.step == stepped.step && session.state_hash.is_some();
    let again = server.until("one", wanted).await;
    assert_eq!(again.state_hash, stepped.state_hash);
    drop(server);
    fs::remove_dir_all(folder).expect("removed");
}

#[tokio::test]
async fn a_session_of_a_version_with_other_bits_stays_in_the_folder() {
    /// Bytes of head and table, behind which their hash stands: ten sections.
    const TABLE_BYTES: usize = 64 + 10 * 28;
    let folder = folder("bits");
    let options = ["--no-token", "--checkpoint-seconds", "3600"];
    let mut server = Server::start(Some(&folder), &options).await;
    server.create("other", v1::Precision::F32).await;
    server.kill();

    let states = files(&folder, "state");
    let mut bytes = fs::read(&states[0]).expect("read");
    bytes[24] ^= 1;
    let hash = xxh3_64(&bytes[..TABLE_BYTES]);
    bytes[TABLE_BYTES..TABLE_BYTES + 8].copy_from_slice(&hash.to_le_bytes());
    fs::write(&states[0], &bytes).expect("written");
    let mut server = Server::start(Some(&folder), &options).await;
    assert!(server.list().await.is_empty(), "its steps would be others");
    let log = server.kill();
    assert!(log.contains("computes other bits") && log.contains("nappe create --from"), "{log}");
    assert_eq!(files(&folder, "state"), states);
    assert_eq!(fs::read_dir(folder.join("setups")).expect("a folder").count(), 1);
    fs::remove_dir_all(folder).expect("removed");
}

/// A message of a caller that shows a token.
fn shown<M>(message: M, token: &str) -> Request<M> {
    let mut request = Request::new(message);
    let shown = format!("Bearer {}", token.trim()).parse().expect("a header");
    request.metadata_mut().insert("authorization", shown);
    request
}

#[tokio::test]
async fn the_same_request_gives_the_same_session_and_the_token_stays() {
    let folder = folder("same");
    let mut server = Server::start(Some(&folder), &[]).await;
    let token = fs::read_to_string(folder.join("token")).expect("a token");
    let request = v1::CreateSessionRequest {
        request_id: "6f1c1d0e-6d0a-4b43-9a6f-1d0d62c6a001".into(),
        ..request("once", v1::Precision::F32)
    };
    let made = server.client.create_session(shown(request.clone(), &token)).await.expect("made");
    let fork = v1::ForkSessionRequest { new_session_id: "fork".into(), ..v1::ForkSessionRequest::of("once") };
    server.client.fork_session(shown(fork, &token)).await.expect("forked");
    server.kill();

    let mut server = Server::start(Some(&folder), &[]).await;
    assert_eq!(fs::read_to_string(folder.join("token")).expect("a token"), token);
    let again = server.client.create_session(shown(request, &token)).await.expect("the same");
    let [made, again] = [made, again].map(|answer| answer.into_inner().session.expect("a session"));
    assert_eq!((again.session_id, again.uid), (made.session_id, made.uid));
    let list = shown(v1::ListSessionsRequest::default(), &token);
    let listed = server.client.list_sessions(list).await.expect("a page").into_inner();
    let ids: Vec<_> = listed.sessions.iter().map(|session| session.session_id.as_str()).collect();
    assert_eq!(ids, ["fork", "once"]);
    drop(server);
    fs::remove_dir_all(folder).expect("removed");
}

#[tokio::test]
async fn a_folder_that_another_server_uses_is_refused_by_name() {
    let folder = folder("used");
    let server = Server::start(Some(&folder), &["--no-token"]).await;
    let mut command = Command::new(env!("CARGO_BIN_EXE_nappe-server"));
    command.args(["--address", "127.0.0.1:0", "--no-token", "--state-dir"]).arg(&folder);
    let mut second = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut said = String::new();
    second.stderr.take().expect("its errors").read_to_string(&mut said).expect("a text");
    assert!(!second.wait().expect("it ends").success());
    assert!(
        said.contains("another server uses it") && said.contains(&folder.display().to_string()),
        "{said}"
    );
    drop(server);
    fs::remove_dir_all(folder).expect("removed");
}

#[tokio::test]
async fn sessions_go_on_where_no_more_bytes_may_be_written() {
    let folder = folder("full");
    let options = ["--no-token", "--max-state-bytes", "10", "--checkpoint-seconds", "0.05"];
    let mut server = Server::start(Some(&folder), &options).await;
    server.create("full", v1::Precision::F32).await;
    assert_eq!(server.step("full", 20).await.step, 20);
    let durability = server.get("full").await.durability.expect("it is to be kept");
    assert_eq!((durability.step, durability.age_seconds), (None, None), "no state is there");
    assert!(durability.problem.contains("--max-state-bytes"), "{durability:?}");
    let log = server.kill();
    assert!(log.contains("is behind") && log.contains("--max-state-bytes"), "{log}");
    let mut server = Server::start(Some(&folder), &options).await;
    assert!(server.list().await.is_empty(), "nothing of it was written");
    drop(server);
    fs::remove_dir_all(folder).expect("removed");
}
