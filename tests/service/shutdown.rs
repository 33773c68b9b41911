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
    frames::PATIENCE,
    harness::{Server, assert_reason, channel, connect, every, latest},
};

/// Far less than the patience of `patient`, and far more than a drain takes.
const SOON: Duration = Duration::from_secs(30);

/// A server that waits for long before it cuts whoever stays.
async fn patient() -> Server {
    Server::configured(Config { drain_seconds: 300.0, ..Config::default() }).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drain_ends_idle_streams_silent_connections_and_stalled_watchers() {
    let mut server = Server::start().await;
    let idle = server.session(sheet(4)).await;
    let busy = server.session(dust(300, "")).await;

    let mut silent = TcpStream::connect(server.app.local_addr()).await.expect("accepted");
    let mut mumbling = TcpStream::connect(server.app.local_addr()).await.expect("accepted");
    mumbling.write_all(b"PRI * HTTP/2").await.expect("sent");
    let mut watch = server.watch(latest(&idle)).await;
    watch.frame().await;
    let mut stalled = connect(&server.app).await;
    let stalled = stalled.watch_frames(every(&busy, 0)).await.expect("the stream opens");
    let mut health = HealthClient::new(channel(&server.app).await);
    let mut health = health.watch(HealthCheckRequest::default()).await.expect("a stream").into_inner();
    assert_eq!(health.next().await.expect("a status").expect("no error").status(), ServingStatus::Serving);
    let mut other = server.client.clone();
    let step =
        v1::StepSessionRequest { step_count: 10_000_000, wait: true, ..v1::StepSessionRequest::of(&busy) };
    let waiting = tokio::spawn(async move { other.step_session(step).await });
    server.until(&busy, |session| session.step > 3).await;

    tokio::time::timeout(PATIENCE, server.app.shutdown()).await.expect("it drains");

    let (_, status) = watch.until_break().await;
    assert_reason(&status, Reason::ServerDraining);
    assert!(status.get_details_retry_info().is_some());
    assert_reason(&waiting.await.expect("no panic").expect_err("cut short"), Reason::ServerDraining);
    let turned = health.next().await.expect("a status").expect("no error").status();
    assert_eq!(turned, ServingStatus::NotServing);
    assert_reason(&health.next().await.expect("an end").expect_err("it is ended"), Reason::ServerDraining);
    for stream in [&mut silent, &mut mumbling] {
        let mut rest = Vec::new();
        let read = tokio::time::timeout(PATIENCE, stream.read_to_end(&mut rest)).await;
        read.expect("closed").ok();
    }
    drop(stalled);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drain_without_stubborn_clients_is_quick() {
    let mut server = patient().await;
    let id = server.session(sheet(4)).await;
    let mut watch = server.watch(latest(&id)).await;
    server.play(&id).await;
    watch.frame().await;
    let reader = tokio::spawn(async move { watch.until_break().await });
    let mut client = server.client.clone();
    let begin = Instant::now();
    server.app.shutdown().await;
    assert!(begin.elapsed() < SOON, "{:?}", begin.elapsed());
    assert_reason(&reader.await.expect("no panic").1, Reason::ServerDraining);
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

    let server = patient().await;
    let mut health = HealthClient::new(channel(&server.app).await);
    let mut health = health.watch(HealthCheckRequest::default()).await.expect("a stream").into_inner();
    health.next().await.expect("a status").expect("no error");
    let mut reflection = ServerReflectionClient::new(channel(&server.app).await);
    let asked = reflection.server_reflection_info(tokio_stream::pending());
    let mut reflection = asked.await.expect("a stream").into_inner();

    let begin = Instant::now();
    server.app.shutdown().await;
    assert!(begin.elapsed() < SOON, "{:?}", begin.elapsed());
    let turned = health.next().await.expect("a status").expect("no error").status();
    assert_eq!(turned, ServingStatus::NotServing);
    assert_reason(&health.next().await.expect("an end").expect_err("ended"), Reason::ServerDraining);
    assert_reason(&reflection.next().await.expect("an end").expect_err("ended"), Reason::ServerDraining);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_call_that_waits_for_a_long_step_learns_of_a_drain_at_once() {
    let mut server = patient().await;
    // A step of minutes.
    let slow =
        server.session(sheet_with(150, "").replace("drag = 1e-4", "drag = 1e-4\nsubsteps = 10000")).await;
    let mut calls = JoinSet::new();
    let step = v1::StepSessionRequest { step_count: 1, wait: true, ..v1::StepSessionRequest::of(&slow) };
    let mut client = server.client.clone();
    calls.spawn(async move { (client.step_session(step).await.err(), Instant::now()) });
    tokio::time::sleep(Duration::from_millis(300)).await;
    let drag = Some(1e-4);
    let calm = v1::UpdateParametersRequest { drag, wait: true, ..v1::UpdateParametersRequest::of(&slow) };
    let watch = v1::WatchFramesRequest { fields: vec![v1::Field::Velocities.into()], ..latest(&slow) };
    let mut client = server.client.clone();
    calls.spawn(async move { (client.update_parameters(calm).await.err(), Instant::now()) });
    let mut client = server.client.clone();
    calls.spawn(async move { (client.watch_frames(watch).await.err(), Instant::now()) });
    tokio::time::sleep(Duration::from_millis(300)).await;

    let begin = Instant::now();
    server.app.shutdown().await;
    let mut cut = 0;
    for (refused, at) in calls.join_all().await {
        assert!(at < begin + SOON, "told {:?} after the drain began", at - begin);
        if let Some(status) = refused {
            assert_reason(&status, Reason::ServerDraining);
            cut += 1;
        }
    }
    println!("{cut} calls waited for the step");
    assert!(cut > 0, "the call for the step waited for it");
}
