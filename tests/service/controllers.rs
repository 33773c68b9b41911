//! Programs that control a session step by step: paths of pins, and one call per step.

use std::time::Instant;

use nappe_client::{Client, Delivery, Event, Field, Fields, Steps, Wait, WatchOptions};
use nappe_proto::v1;
use nappe_server::{Limits, Reason};

use crate::{
    cloth_scenes::{dust, sheet},
    harness::{Server, assert_reason},
};

/// Where a hand holds pin 0 after so many steps.
fn hand(step: u64) -> [f64; 3] {
    [1e-3 * (0.1 * step as f64).sin(), 0.0, 1e-3 * step as f64]
}

/// Time step of the sheet (s).
const DT: f64 = 0.002;

/// A move of pin 0 within one step.
fn pin(step: u64) -> v1::PinUpdate {
    v1::PinUpdate { particle: 0, target: Some(hand(step).into()), duration_seconds: DT }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_path_of_a_pin_is_one_call_with_the_bits_of_one_call_per_step() {
    let mut server = Server::start().await;
    let by_calls = server.session(sheet(6)).await;
    for step in 1..=200 {
        let request = v1::UpdateParametersRequest {
            pins: vec![pin(step)],
            at_step: step - 1,
            ..v1::UpdateParametersRequest::of(&by_calls)
        };
        server.client.update_parameters(request).await.expect("accepted");
    }
    let by_calls = server.step(&by_calls, 210).await.state_hash;

    let by_path = server.session(sheet(6)).await;
    let path = v1::PinPath {
        particle: 0,
        times_seconds: (1..=200).map(|step| DT * f64::from(step)).collect(),
        targets: (1..=200).flat_map(hand).collect(),
    };
    let request = v1::UpdateParametersRequest {
        paths: vec![path.clone()],
        ..v1::UpdateParametersRequest::of(&by_path)
    };
    server.client.update_parameters(request.clone()).await.expect("accepted");
    assert_eq!(server.step(&by_path, 210).await.state_hash, by_calls);

    let short = v1::PinPath { targets: path.targets[1..].to_vec(), ..path.clone() };
    let backwards = v1::PinPath { times_seconds: path.times_seconds.iter().rev().copied().collect(), ..path };
    for (bad, reason) in [(short, Reason::InvalidField), (backwards, Reason::InvalidChange)] {
        let request = v1::UpdateParametersRequest { paths: vec![bad], ..request.clone() };
        let refused = server.client.update_parameters(request).await.expect_err("no path");
        assert_reason(&refused, reason);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn points_of_paths_count_as_changes() {
    let limits = Limits { max_changes_per_call: 10, max_pending_changes: 15, ..Limits::default() };
    let mut server = Server::with(limits).await;
    let id = server.session(sheet(4)).await;
    let path = |count: u64| v1::PinPath {
        particle: 0,
        times_seconds: (1..=count).map(|step| DT * step as f64).collect(),
        targets: (1..=count).flat_map(hand).collect(),
    };
    let request = |count, at_step| v1::UpdateParametersRequest {
        paths: vec![path(count)],
        at_step,
        ..v1::UpdateParametersRequest::of(&id)
    };
    let refused = server.client.update_parameters(request(11, 0)).await.expect_err("too many points");
    assert_eq!(assert_reason(&refused, Reason::TooManyChanges)["changes"], "11");
    server.client.update_parameters(request(10, 5)).await.expect("as many as are allowed");
    let refused = server.client.update_parameters(request(10, 6)).await.expect_err("too many wait");
    assert_eq!(assert_reason(&refused, Reason::TooManyChanges)["changes"], "20");
    server.step(&id, 6).await;
    server.client.update_parameters(request(10, 20)).await.expect("there is room again");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_controller_needs_one_call_per_step_and_gets_the_same_bits() {
    const STEPS: u64 = 300;
    let server = Server::start().await;
    let client = Client::connect(&server.app.url()).await.expect("connected");
    let make = |text: String| client.create_session(nappe_client::CreateSession::from_text(text));

    // Three messages each way: change, step, and the frame from a stream.
    let id = make(sheet(20)).await.expect("made").session.session_id;
    let options = WatchOptions { delivery: Delivery::Every, ..WatchOptions::every_from(1) };
    let mut frames = client.watch(&id, options).await.expect("a stream");
    let begin = Instant::now();
    let mut apart = None;
    for step in 1..=STEPS {
        let pins = vec![pin(step)];
        let update = v1::UpdateParametersRequest { pins, ..v1::UpdateParametersRequest::of(&id) };
        client.update(update).await.expect("accepted");
        client.step(&id, 1, Wait::Yes).await.expect("stepped");
        apart = loop {
            if let Event::Frame(frame) = frames.next().await.expect("no end").expect("no error") {
                break Some(frame.positions);
            }
        };
    }
    let time_apart = begin.elapsed();
    let apart = (client.get_session(&id).await.expect("there").state_hash, apart.expect("frames"));

    // One message each way, which holds all three.
    let id = make(sheet(20)).await.expect("made").session.session_id;
    let begin = Instant::now();
    let mut together = None;
    for step in 1..=STEPS {
        let changes = Some(v1::Changes { pins: vec![pin(step)], ..v1::Changes::default() });
        let steps = Steps { changes, to_step: Some(step), ..Steps::default() };
        let (session, frame) = client.advance(&id, steps).await.expect("stepped");
        assert_eq!((session.step, frame.step), (step, step));
        together = Some((session.state_hash, frame.positions));
    }
    let time_together = begin.elapsed();
    assert_eq!(together, Some(apart));
    let each = |time: std::time::Duration| 1e3 * time.as_secs_f64() / STEPS as f64;
    println!(
        "{:.3} ms per step with 2 calls and a stream, {:.3} ms with 1",
        each(time_apart),
        each(time_together)
    );

    // Repeated, it changes and steps no more.
    let late = v1::Changes { gravity: Some([0.0; 3].into()), ..v1::Changes::default() };
    let steps = Steps { changes: Some(late), to_step: Some(STEPS), ..Steps::default() };
    let (session, _) = client.advance(&id, steps).await.expect("harmless");
    assert_eq!((session.step, session.state_hash), (STEPS, together.expect("steps").0));
    let next = client.step(&id, 1, Wait::Yes).await.expect("stepped");
    assert_ne!(next.parameters.expect("parameters").gravity, Some([0.0; 3].into()));
}

#[tokio::test(flavor = "multi_thread")]
async fn steps_whose_changes_are_refused_are_not_taken() {
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;
    let client = Client::connect(&server.app.url()).await.expect("connected");
    let not_pinned = v1::PinUpdate { particle: 9, ..pin(1) };
    let changes = Some(v1::Changes { pins: vec![not_pinned], ..v1::Changes::default() });
    let steps = Steps { step_count: 5, changes, ..Steps::default() };
    let refused = client.advance(&id, steps.clone()).await.expect_err("not pinned");
    assert_eq!(refused.known_reason(), Some(Reason::InvalidChange));
    assert_eq!(server.get(&id).await.step, 0);

    // Nor are changes made whose steps are refused.
    server.play(&id).await;
    let calm = v1::Changes { gravity: Some([0.0; 3].into()), ..v1::Changes::default() };
    let steps = Steps { changes: Some(calm), ..steps };
    let refused = client.advance(&id, steps).await.expect_err("it plays");
    assert_eq!(refused.known_reason(), Some(Reason::SessionPlaying));
    let step = server.get(&id).await.step;
    let session = server.until(&id, |session| session.step > step + 2).await;
    assert_ne!(session.parameters.expect("parameters").gravity, Some([0.0; 3].into()));

    // A frame in an answer has what was asked for, between frames of the streams too, and a bound.
    let id = server.session(dust(4, "frame_interval = 10")).await;
    let fields = Fields::positions().with(Field::Velocities);
    let (session, frame) =
        client.advance(&id, Steps { step_count: 3, fields, ..Steps::default() }).await.expect("stepped");
    assert_eq!((session.frame, frame.frame, frame.step), (0, 0, 3));
    assert_eq!(frame.velocities.map(|velocities| velocities.len()), Some(16));
    let large = server.session(dust(600, "")).await;
    let refused = client.advance(&large, Steps::default()).await.expect_err("4.3 MB");
    assert_eq!(refused.known_reason(), Some(Reason::FrameTooLarge));
    let request = v1::StepSessionRequest {
        frame: Some(v1::FrameRequest::default()),
        ..v1::StepSessionRequest::of(&id)
    };
    let refused = server.client.step_session(request).await.expect_err("without waiting");
    assert_eq!(assert_reason(&refused, Reason::InvalidField)["field"], "frame");
}
