//! A shutdown ends whatever clients do, and every stream is told.

use std::time::{Duration, Instant};

use nappe_proto::v1;
use nappe_server::{Config, Reason};
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::TcpStream,
    task::JoinSet,
};
use tokio_stream::StreamExt as _;
use tonic_health::pb::{
    HealthCheckRequest, health_check_response::ServingStatus, health_client::HealthClient,
};
use tonic_types::StatusExt as _;

use crate::{
    cloth_scenes::{dust, sheet, sheet_with},
    frames::in_time,
    harness::{Server, assert_reason, channel, config, connect, every, latest},
};

#[tokio::test(flavor = "multi_thread")]
async fn a_drain_ends_idle_streams_silent_connections_and_calls_that_wait() {
    let mut server = Server::start().await;
    let idle = server.session(sheet(4)).await;
    let busy = server.session(dust(100, "")).await;

    let mut silent = TcpStream::connect(server.app.local_addr()).await.expect("accepted");
    let mut mumbling = TcpStream::connect(server.app.local_addr()).await.expect("accepted");
    mumbling.write_all(b"PRI * HTTP/2").await.expect("sent");
    let mut watch = server.watch(latest(&idle)).await;
    watch.frame().await;
    let mut health = HealthClient::new(channel(&server.app).await);
    let mut health = health.watch(HealthCheckRequest::default()).await.expect("a stream").into_inner();
    let status = in_time(health.next()).await.expect("a status").expect("no error").status();
    assert_eq!(status, ServingStatus::Serving);
    let mut other = server.client.clone();
    let step =
        v1::StepSessionRequest { step_count: 10_000_000, wait: true, ..v1::StepSessionRequest::of(&busy) };
    let waiting = tokio::spawn(async move { other.step_session(step).await });
    server.until(&busy, |session| session.step > 3).await;

    // Far sooner than it would cut whoever stays.
    in_time(server.app.shutdown()).await;

    let (_, status) = watch.until_break().await;
    assert_reason(&status, Reason::ServerDraining);
    assert!(status.get_details_retry_info().is_some());
    let waited = in_time(waiting).await.expect("no panic");
    assert_reason(&waited.expect_err("cut short"), Reason::ServerDraining);
    let turned = in_time(health.next()).await.expect("a status").expect("no error").status();
    assert_eq!(turned, ServingStatus::NotServing);
    let ended = in_time(health.next()).await.expect("an end").expect_err("it is ended");
    assert_reason(&ended, Reason::ServerDraining);
    for stream in [&mut silent, &mut mumbling] {
        in_time(stream.read_to_end(&mut Vec::new())).await.ok();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drain_cuts_stalled_watchers_when_its_time_is_over() {
    let mut server = Server::configured(Config { drain_seconds: 1.0, ..config() }).await;
    let busy = server.session(dust(300, "")).await;
    let mut stalled = connect(&server.app).await;
    let stalled = stalled.watch_frames(every(&busy, 0)).await.expect("the stream opens");
    server.step(&busy, 5).await;
    let begin = Instant::now();
    in_time(server.app.shutdown()).await;
    assert!(begin.elapsed() > Duration::from_millis(990), "it had its time: {:?}", begin.elapsed());
    drop(stalled);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drain_cuts_sixty_stalled_watchers_long_before_its_time_is_over() {
    let mut server = Server::configured(Config { drain_stall_seconds: 0.4, ..config() }).await;
    let busy = server.session(dust(300, "")).await;
    let mut stalled = Vec::new();
    for _ in 0..60 {
        let mut client = connect(&server.app).await;
        stalled.push(client.watch_frames(every(&busy, 0)).await.expect("the stream opens"));
    }
    server.step(&busy, 5).await;
    // The time of this drain is minutes.
    in_time(server.app.shutdown()).await;
    drop(stalled);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drain_without_stubborn_clients_is_quick() {
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;
    let mut watch = server.watch(latest(&id)).await;
    server.play(&id).await;
    watch.frame().await;
    let reader = tokio::spawn(async move { watch.until_break().await });
    let mut client = server.client.clone();
    in_time(server.app.shutdown()).await;
    assert_reason(&in_time(reader).await.expect("no panic").1, Reason::ServerDraining);
    client.get_server_info(v1::GetServerInfoRequest {}).await.expect_err("nobody listens any more");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_dropped_server_drains_too() {
    let mut server = Server::start().await;
    let id = server.session(sheet(4)).await;
    let mut watch = server.watch(latest(&id)).await;
    drop(server);
    assert_reason(&watch.until_break().await.1, Reason::ServerDraining);
}

#[tokio::test(flavor = "multi_thread")]
async fn watchers_of_health_and_reflection_do_not_hold_a_drain_up() {
    use tonic_reflection::pb::v1::server_reflection_client::ServerReflectionClient;

    let server = Server::start().await;
    let mut health = HealthClient::new(channel(&server.app).await);
    let mut health = health.watch(HealthCheckRequest::default()).await.expect("a stream").into_inner();
    in_time(health.next()).await.expect("a status").expect("no error");
    let mut reflection = ServerReflectionClient::new(channel(&server.app).await);
    let asked = reflection.server_reflection_info(tokio_stream::pending());
    let mut reflection = asked.await.expect("a stream").into_inner();

    in_time(server.app.shutdown()).await;
    let turned = in_time(health.next()).await.expect("a status").expect("no error").status();
    assert_eq!(turned, ServingStatus::NotServing);
    let ended = in_time(health.next()).await.expect("an end").expect_err("ended");
    assert_reason(&ended, Reason::ServerDraining);
    let ended = in_time(reflection.next()).await.expect("an end").expect_err("ended");
    assert_reason(&ended, Reason::ServerDraining);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_call_that_waits_for_a_long_step_learns_of_a_drain_at_once() {
    let mut server = Server::start().await;
    // A step of minutes.
    let slow =
        server.session(sheet_with(300, "").replace("drag = 1e-4", "drag = 1e-4\nsubsteps = 10000")).await;
    server.mark_first_step(&slow).await;
    let mut calls = JoinSet::new();
    let step = v1::StepSessionRequest { step_count: 1, wait: true, ..v1::StepSessionRequest::of(&slow) };
    let mut client = server.client.clone();
    calls.spawn(async move { client.step_session(step).await.err() });
    server.until_marked_step(&slow).await;
    let drag = Some(1e-4);
    let calm = v1::UpdateParametersRequest { drag, wait: true, ..v1::UpdateParametersRequest::of(&slow) };
    let watch = v1::WatchFramesRequest { fields: vec![v1::Field::Velocities.into()], ..latest(&slow) };
    let mut client = server.client.clone();
    calls.spawn(async move { client.update_parameters(calm).await.err() });
    server.until_pending(&slow, 1).await;
    let mut watch = server.watch(watch).await;

    in_time(server.app.shutdown()).await;
    let mut cut = 0;
    for status in in_time(calls.join_all()).await.into_iter().flatten() {
        assert_reason(&status, Reason::ServerDraining);
        cut += 1;
    }
    assert_eq!(cut, 2, "the call for the step waited for it, and so did the change");
    assert_reason(&watch.until_break().await.1, Reason::ServerDraining);
}
