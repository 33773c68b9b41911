//! Every limit of the configuration once: what it refuses, and with which reason.

use std::time::{Duration, Instant};

use bytes::Bytes;
use nappe_proto::v1::{
    self, MeshHeader, UploadMeshRequest, create_session_request::Scene, upload_mesh_request::Part,
};
use nappe_server::{Address, App, Config, Limits, RankSettings, Reason, StartError};
use tokio::{io::AsyncReadExt as _, net::TcpStream};
use tonic::{Response, Status};

use crate::{
    cloth_scenes::{dust, sheet},
    frames::in_time,
    harness::{Server, assert_reason, config, connect, latest, request, started},
};

fn text(text: String) -> v1::CreateSessionRequest {
    v1::CreateSessionRequest { scene: Some(Scene::SceneText(text)), ..request() }
}

fn assert_refused<T: std::fmt::Debug>(answer: Result<Response<T>, Status>, reason: Reason) {
    assert_reason(&answer.expect_err("beyond the limit"), reason);
}

#[tokio::test(flavor = "multi_thread")]
async fn limits_are_reported_as_they_are_configured() {
    let limits =
        Limits { max_sessions: 3, max_threads_per_session: 2, max_mesh_bytes: 77, ..Limits::default() };
    let mut server = Server::with(limits.clone()).await;
    let info = server.client.get_server_info(v1::GetServerInfoRequest {}).await.expect("info").into_inner();
    let reported = info.limits.expect("limits");
    assert_eq!(
        (reported.max_sessions, reported.max_threads_per_session, reported.max_mesh_bytes),
        (3, 2, 77)
    );
    assert_eq!(reported.max_pending_changes, limits.max_pending_changes);
    assert_eq!(reported.history_bytes_per_session, limits.history_bytes_per_session);
    assert!(info.thread_count >= 1 && !info.version.is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_and_watchers_are_limited() {
    let limits = Limits { max_sessions: 2, max_watchers_per_session: 1, ..Limits::default() };
    let mut server = Server::with(limits).await;

    let id = server.session(sheet(3)).await;
    server.session(sheet(3)).await;
    assert_refused(server.client.create_session(text(sheet(3))).await, Reason::TooManySessions);
    let watch = server.watch(latest(&id)).await;
    assert_refused(server.client.watch_frames(latest(&id)).await, Reason::TooManyWatchers);
    let diagnostics =
        v1::WatchDiagnosticsRequest { max_rate_hz: 0.0, ..v1::WatchDiagnosticsRequest::of(&id) };
    assert_refused(server.client.watch_diagnostics(diagnostics).await, Reason::TooManyWatchers);
    drop(watch);
    server.until(&id, |session| session.watcher_count == 0).await;
    server.watch(latest(&id)).await;

    // A deleted session gives its place back before the call returns.
    for _ in 0..20 {
        let [id, _] = listed(&mut server).await;
        server.client.delete_session(v1::DeleteSessionRequest::of(id)).await.expect("deleted");
        server.session(sheet(3)).await;
    }
}

async fn listed(server: &mut Server) -> [String; 2] {
    let page = server.client.list_sessions(v1::ListSessionsRequest::default()).await.expect("a page");
    let ids: Vec<String> = page.into_inner().sessions.into_iter().map(|s| s.session_id).collect();
    ids.try_into().expect("two sessions")
}

#[tokio::test(flavor = "multi_thread")]
async fn particles_springs_scene_bytes_threads_and_steps_are_limited() {
    let limits = Limits {
        max_particles: 100,
        max_springs: 200,
        max_scene_bytes: 1000,
        max_threads_per_session: 1,
        max_steps_per_call: 50,
        ..Limits::default()
    };
    let mut server = Server::with(limits).await;
    assert_refused(server.client.create_session(text(dust(11, ""))).await, Reason::SceneTooLarge);
    assert_refused(server.client.create_session(text(sheet(10))).await, Reason::SceneTooLarge);
    let long = format!("# {}\n{}", "x".repeat(1000), sheet(3));
    assert_refused(server.client.create_session(text(long)).await, Reason::SceneTooLarge);
    let wide = v1::CreateSessionRequest { thread_count: 2, ..text(sheet(3)) };
    assert_refused(server.client.create_session(wide).await, Reason::InvalidField);
    let id = server.create(v1::CreateSessionRequest { thread_count: 0, ..text(sheet(7)) }).await;
    assert_eq!(server.get(&id).await.thread_count, 1, "as many as are allowed");
    let step = v1::StepSessionRequest { step_count: 51, wait: true, ..v1::StepSessionRequest::of(&id) };
    assert_refused(server.client.step_session(step).await, Reason::InvalidField);
    assert_eq!(server.step(&id, 50).await.step, 50);
}

#[tokio::test(flavor = "multi_thread")]
async fn bytes_and_number_of_meshes_are_limited() {
    let limits = Limits { max_mesh_bytes: 100, max_meshes: 2, max_particles: 1000, ..Limits::default() };
    let mut server = Server::with(limits).await;

    let header = |point_count| UploadMeshRequest {
        part: Some(Part::Header(MeshHeader { point_count, ..MeshHeader::default() })),
    };
    for point_count in [5, 1001, u64::MAX] {
        let pieces = tokio_stream::iter([header(point_count)]);
        assert_refused(server.client.upload_mesh(pieces).await, Reason::MeshTooLarge);
    }

    let mut ids = Vec::new();
    for _ in 0..3 {
        let data = UploadMeshRequest { part: Some(Part::Data(Bytes::from(vec![0; 96]))) };
        let upload = server.client.upload_mesh(tokio_stream::iter([header(4), data])).await.expect("it fits");
        ids.push(upload.into_inner().mesh_id);
    }

    let scene = |id: &str| {
        let body = "[[body]]\nname = \"b\"\nmass = { particle = 1.0 }";
        text(format!("version = 1\ndt = 0.01\n{body}\nmesh = {{ upload = \"{id}\" }}\n"))
    };
    assert_refused(server.client.create_session(scene(&ids[0])).await, Reason::MeshNotFound);
    for id in &ids[1..] {
        server.create(scene(id)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn bytes_of_a_message_and_waiting_changes_are_limited() {
    let limits = Limits { max_message_bytes: 10_000, max_pending_changes: 3, ..Limits::default() };
    let mut server = Server::with(limits).await;
    let long = format!("# {}\n{}", "x".repeat(20_000), sheet(3));
    assert_refused(server.client.create_session(text(long)).await, Reason::MessageTooLarge);
    let data = UploadMeshRequest { part: Some(Part::Data(Bytes::from(vec![0; 20_000]))) };
    let header = MeshHeader { point_count: 1000, ..MeshHeader::default() };
    let header = UploadMeshRequest { part: Some(Part::Header(header)) };
    let upload = server.client.upload_mesh(tokio_stream::iter([header, data])).await;
    assert_refused(upload, Reason::MessageTooLarge);
    let id = server.session(sheet(3)).await;
    let update = |at_step| v1::UpdateParametersRequest {
        session_id: id.clone(),
        at_step,
        drag: Some(0.1),
        ..v1::UpdateParametersRequest::default()
    };
    for at_step in [10, 20, 30] {
        server.client.update_parameters(update(at_step)).await.expect("room");
    }

    assert_refused(server.client.update_parameters(update(40)).await, Reason::TooManyChanges);
    server.step(&id, 11).await;
    server.client.update_parameters(update(40)).await.expect("room again");
}

#[tokio::test(flavor = "multi_thread")]
async fn connections_are_limited() {
    let mut server = Server::with(Limits { max_connections: 2, ..Limits::default() }).await;
    let mut second = connect(&server.app).await;
    let info = v1::GetServerInfoRequest {};
    for client in [&mut server.client, &mut second] {
        client.get_server_info(info).await.expect("a whole request");
    }

    // The third is closed at once.
    let mut third = TcpStream::connect(server.app.local_addr()).await.expect("the system accepts it");
    assert!(closed(&mut third).await);

    // The others are served on.
    for client in [&mut server.client, &mut second] {
        client.get_server_info(info).await.expect("served");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_connection_that_never_says_anything_is_closed() {
    // Nobody else is connected, who could be late too.
    let app = started(Config { handshake_seconds: 0.5, ..config() });
    let start = Instant::now();
    let mut silent = TcpStream::connect(app.local_addr()).await.expect("accepted");
    assert!(closed(&mut silent).await && start.elapsed() > Duration::from_millis(490));
}

async fn closed(stream: &mut TcpStream) -> bool {
    let mut byte = [0; 1];
    in_time(stream.read(&mut byte)).await.map_or(true, |count| count == 0)
}

#[tokio::test(flavor = "multi_thread")]
async fn calls_on_one_connection_are_limited() {
    let limits = Limits { max_streams_per_connection: 1, ..Limits::default() };
    let mut server = Server::with(limits).await;
    let id = server.session(sheet(3)).await;
    let watch = server.watch(latest(&id)).await;

    // The client holds the second call back until the stream ends.
    let mut other = server.client.clone();
    let second = tokio::spawn(async move { other.get_server_info(v1::GetServerInfoRequest {}).await });
    tokio::time::sleep(Duration::from_millis(300)).await;
    assert!(!second.is_finished());
    drop(watch);
    let answer = in_time(second).await.expect("no panic");
    answer.expect("answered");
}

#[tokio::test]
async fn an_address_that_other_machines_reach_needs_a_flag() {
    let address: Address = "0.0.0.0:0".parse().expect("an address");
    let refused = App::start(Config { address: address.clone(), ..Config::default() }).expect_err("no flag");
    assert!(matches!(refused, StartError::Remote(_)));
    assert!(refused.to_string().contains("--allow-remote"), "{refused}");
    App::start(Config { address, allow_remote: true, ..Config::default() })
        .expect("with the flag")
        .shutdown()
        .await;
    let bad = Config { drain_seconds: f64::NAN, ..Config::default() };
    assert!(matches!(App::start(bad), Err(StartError::BadSeconds { .. })));
    let ranks = RankSettings { rank_silence: 4, ..RankSettings::default() };
    let refused = App::start(Config { ranks, ..Config::default() }).expect_err("signs of life are 2 s apart");
    assert!(refused.to_string().contains("rank_silence is 4: allowed are 5 to 86400"), "{refused}");
    let taken =
        App::start(Config { address: "127.0.0.1:0".parse().expect("an address"), ..Config::default() });
    let taken = taken.expect("a free port");
    let again = App::start(Config { address: taken.local_addr().into(), ..Config::default() });
    assert!(matches!(again, Err(StartError::Bind { .. })));
}
