//! A server that many use at once, one of them badly: bounds on what waits, on what is asked for and for how long,
//! on who may call; and what everybody else notices of it.

use std::time::{Duration, Instant};

use base64::{Engine as _, engine::general_purpose::STANDARD_NO_PAD};
use nappe_proto::v1;
use nappe_server::{Config, Limits, Reason};
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::TcpStream,
    task::JoinSet,
};
use tonic::{Status, transport::Channel};

use crate::{
    cloth_scenes::{dust, sheet},
    frames::in_time,
    harness::{Client, Server, assert_reason, config, connect, every},
};

/// How long fields are still made after the last who wanted them has left.
const LINGER: Duration = Duration::from_secs(5);

fn update(id: &str) -> v1::UpdateParametersRequest {
    v1::UpdateParametersRequest { session_id: id.into(), ..v1::UpdateParametersRequest::default() }
}

#[tokio::test(flavor = "multi_thread")]
async fn numbers_beyond_the_ranges_of_the_format_are_refused_and_change_nothing() {
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;
    let stiff = |stiffness| v1::SpringUpdate { stiffness: Some(stiffness), ..v1::SpringUpdate::default() };
    let pin = |x, duration_seconds| v1::PinUpdate {
        particle: 0,
        target: Some([x, 0.0, 0.0].into()),
        duration_seconds,
    };
    for bad in [
        v1::UpdateParametersRequest { wind: Some([1e308, 0.0, 0.0].into()), ..update(&id) },
        v1::UpdateParametersRequest { gravity: Some([0.0, -1.001e4, 0.0].into()), ..update(&id) },
        v1::UpdateParametersRequest { drag: Some(-1e-9), ..update(&id) },
        v1::UpdateParametersRequest { springs: vec![stiff(1.1e12)], ..update(&id) },
        v1::UpdateParametersRequest { pins: vec![pin(1.1e6, 1.0)], ..update(&id) },
        v1::UpdateParametersRequest { pins: vec![pin(0.0, 1.1e9)], ..update(&id) },
    ] {
        let refused = server.client.update_parameters(bad).await.expect_err("beyond the range");
        let metadata = assert_reason(&refused, Reason::InvalidChange);
        assert!(metadata["allowed"].contains(" to "), "{metadata:?}");
    }

    let far = v1::UpdateParametersRequest { at_step: 10_000_001, drag: Some(0.1), ..update(&id) };
    let refused = server.client.update_parameters(far.clone()).await.expect_err("too far ahead");
    assert_eq!(assert_reason(&refused, Reason::InvalidField)["allowed"], "10000000");
    let near = v1::UpdateParametersRequest { at_step: 10_000_000, ..far };
    server.client.update_parameters(near).await.expect("just near enough");

    let untouched = server.session(sheet(4)).await;
    let (id, untouched) = (server.step(&id, 20).await, server.step(&untouched, 20).await);
    assert_eq!(id.state_hash, untouched.state_hash);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_changes_of_one_call_are_limited() {
    let mut server = Server::with(Limits { max_changes_per_call: 3, ..Limits::default() }).await;
    let id = server.session(sheet(4)).await;
    let soft = v1::SpringUpdate { stiffness: Some(10.0), ..v1::SpringUpdate::default() };
    let many = |count| v1::UpdateParametersRequest { springs: vec![soft.clone(); count], ..update(&id) };
    let refused = server.client.update_parameters(many(4)).await.expect_err("one too many");
    assert_eq!(assert_reason(&refused, Reason::TooManyChanges)["allowed"], "3");
    server.client.update_parameters(many(3)).await.expect("as many as are allowed");
}

#[tokio::test(flavor = "multi_thread")]
async fn calls_that_wait_for_a_step_are_limited() {
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;

    // The step that they wait for does not begin before it is asked for: more of them than are allowed.
    let mut calls = JoinSet::new();
    for _ in 0..100 {
        let (mut client, id) = (server.client.clone(), id.clone());
        calls.spawn(async move {
            let calm =
                v1::UpdateParametersRequest { drag: Some(1e-4), wait: true, at_step: 5, ..update(&id) };
            client.update_parameters(calm).await
        });
    }
    for _ in 0..36 {
        let answer = in_time(calls.join_next()).await.expect("36 are refused").expect("no panic");
        let refused = answer.expect_err("nothing steps");
        assert_eq!(assert_reason(&refused, Reason::TooManyCommands)["allowed"], "64");
    }

    // Those who wait are answered, and it obeys.
    let steps = v1::StepSessionRequest { step_count: 6, ..v1::StepSessionRequest::of(&id) };
    server.client.step_session(steps).await.expect("a call that does not wait is accepted");
    while let Some(answer) = in_time(calls.join_next()).await {
        let accepted = answer.expect("no panic").expect("the step has begun").into_inner();
        assert_eq!(accepted.effective_step, 5);
    }
    server.until(&id, |session| session.step == 6).await;
    server.client.delete_session(v1::DeleteSessionRequest::of(id)).await.expect("deleted");
}

#[tokio::test(flavor = "multi_thread")]
async fn fields_are_made_for_present_watchers_and_not_for_those_who_left() {
    let mut server = Server::start().await;
    let id = server.session(dust(4, "frame_interval = 1")).await;
    let fast = |from_frame| v1::WatchFramesRequest {
        fields: vec![v1::Field::Velocities.into()],
        encoding: v1::Encoding::RawF64.into(),
        ..every(&id, from_frame)
    };

    // Who comes back at once misses nothing. A busy machine may not let us, and then we try again.
    let mut newest = 0;
    loop {
        let watch = server.watch(fast(newest)).await;
        server.step(&id, 5).await;
        let left = Instant::now();
        drop(watch);
        server.until(&id, |session| session.watcher_count == 0).await;
        server.step(&id, 5).await;
        let is_at_once = left.elapsed() < LINGER;
        newest += 10;
        match server.client.watch_frames(fast(newest - 4)).await {
            Ok(stream) => break drop(stream),
            Err(status) => assert!(!is_at_once, "{status:?}"),
        }
    }
    server.until(&id, |session| session.watcher_count == 0).await;

    // Later nobody wants velocities any more.
    tokio::time::sleep(LINGER + Duration::from_millis(200)).await;
    server.step(&id, 5).await;
    let refused = server.client.watch_frames(fast(newest + 2)).await.expect_err("without velocities");
    let metadata = assert_reason(&refused, Reason::FrameExpired);
    let made_complete = (newest + 5).to_string();
    assert_eq!(metadata["oldest_frame"], made_complete, "the newest is, for who asks: {metadata:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_to_another_host_is_refused() {
    let server = Server::start().await;
    let named = |origin: &str| {
        let endpoint = Channel::from_shared(server.app.url()).expect("a URL");
        endpoint.origin(origin.parse().expect("an origin")).connect_lazy()
    };
    let info = v1::GetServerInfoRequest {};
    let rebound = Client::new(named("http://evil.example:6277")).get_server_info(info).await;
    let metadata = assert_reason(&rebound.expect_err("not ours"), Reason::HostNotAllowed);
    assert_eq!(metadata["host"], "evil.example:6277");
    Client::new(named("http://localhost:6277")).get_server_info(info).await.expect("ours");

    let allowed_hosts = vec!["node7.example".to_owned()];
    let server = Server::configured(Config { allowed_hosts, ..config() }).await;
    let endpoint = Channel::from_shared(server.app.url()).expect("a URL");
    let named = endpoint.origin("http://node7.example".parse().expect("an origin")).connect_lazy();
    Client::new(named).get_server_info(info).await.expect("ours by its setting");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_that_does_not_arrive_is_given_up() {
    let server = Server::configured(Config { request_seconds: 0.3, ..config() }).await;
    let mut stream = TcpStream::connect(server.app.local_addr()).await.expect("accepted");
    let head = "POST /nappe.v1.SimulationService/GetSession HTTP/1.1\r\nHost: localhost\r\n\
                Content-Type: application/grpc-web+proto\r\nContent-Length: 1000\r\nConnection: close\r\n\r\n";
    // At once: between two pieces the server may have answered and closed already.
    stream.write_all(&[head.as_bytes(), &[0, 0, 0]].concat()).await.expect("sent");
    let mut answer = Vec::new();
    in_time(stream.read_to_end(&mut answer)).await.expect("read");
    let answer = String::from_utf8_lossy(&answer);
    let details = answer.lines().find_map(|line| line.strip_prefix("grpc-status-details-bin: "));
    let details = STANDARD_NO_PAD.decode(details.expect("details").trim_end_matches('=')).expect("base64");
    let status = Status::with_details(Reason::RequestTooSlow.code(), "too slow", details.into());
    assert_eq!(assert_reason(&status, Reason::RequestTooSlow)["seconds"], "0.3");
}

#[tokio::test(flavor = "multi_thread")]
async fn connections_from_one_address_are_limited() {
    let limits = Limits { max_connections_per_address: 2, ..Limits::default() };
    let mut server = Server::with(limits).await;
    let mut second = connect(&server.app).await;
    let info = v1::GetServerInfoRequest {};
    // Whoever has sent a whole request is no stranger, and gives way to nobody.
    second.get_server_info(info).await.expect("answered");
    server.client.get_server_info(info).await.expect("answered");
    let mut third = TcpStream::connect(server.app.local_addr()).await.expect("the system accepts it");
    let mut byte = [0; 1];
    let read = in_time(third.read(&mut byte)).await;
    assert!(read.map_or(true, |count| count == 0), "the third is closed at once");
    drop(second);
    server.client.get_server_info(info).await.expect("the first is served on");
}
