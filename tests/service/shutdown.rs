//! A shutdown takes less than five seconds whatever clients do, and every stream is told.

use std::time::{Duration, Instant};

use nappe_proto::v1;
use nappe_server::Reason;
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::TcpStream,
};
use tokio_stream::StreamExt as _;
use tonic_health::pb::{
    HealthCheckRequest, health_check_response::ServingStatus, health_client::HealthClient,
};
use tonic_types::StatusExt as _;

use crate::{
    cloth_scenes::{dust, sheet},
    frames::PATIENCE,
    harness::{Server, assert_reason, channel, connect, every, latest},
};

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

    let begin = Instant::now();
    server.app.shutdown().await;
    let took = begin.elapsed();
    println!("drained in {took:?}");
    assert!(took < Duration::from_secs(5), "{took:?}");

    let (_, status) = watch.until_break().await;
    assert_reason(&status, Reason::ServerDraining);
    assert!(status.get_details_retry_info().is_some());
    assert_reason(&waiting.await.expect("no panic").expect_err("cut short"), Reason::ServerDraining);
    let turned = health.next().await.expect("a status").expect("no error").status();
    assert_eq!(turned, ServingStatus::NotServing);
    for stream in [&mut silent, &mut mumbling] {
        let mut rest = Vec::new();
        let read = tokio::time::timeout(PATIENCE, stream.read_to_end(&mut rest)).await;
        read.expect("closed").ok();
    }
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
    let begin = Instant::now();
    server.app.shutdown().await;
    assert!(begin.elapsed() < Duration::from_secs(2), "{:?}", begin.elapsed());
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
