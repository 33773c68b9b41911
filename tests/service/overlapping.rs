//! Surfaces of which all triangles overlap, so that looks at them take minutes: given up with whoever asked for them.

use std::time::Duration;

use nappe_client::MeshUpload;
use nappe_proto::v1::{self, SessionState, create_session_request::Scene};
use nappe_server::{Limits, Reason};
use tokio::time::{sleep, timeout};

use crate::{
    cloth_scenes::sheet,
    frames::in_time,
    harness::{Server, assert_reason, request},
};

/// Triangles of which all pairs are looked at for minutes on one thread: where each pair is seen to be apart, and where crossings alone are counted.
const MANY: usize = 20_000;
const MORE: usize = 60_000;
/// Time after which a caller goes.
const PATIENCE: Duration = Duration::from_millis(500);

/// Corners (m) of so many slanted triangles, each moved from where the first one lies.
fn points(count: usize, moved: impl Fn(usize) -> [f64; 3]) -> Vec<[f64; 3]> {
    let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let triangle = |k: usize| corners.map(|corner| [0, 1, 2].map(|c: usize| corner[c] + moved(k)[c]));
    (0..count).flat_map(triangle).collect()
}

/// Triangles so near each other that their boxes all overlap, none of which crosses or touches another.
fn sheaf(count: usize) -> Vec<[f64; 3]> {
    points(count, |k| [1e-5 * k as f64; 3])
}

/// A scene of an uploaded body of such triangles, with more lines at the root and at the body.
async fn scene(server: &Server, points: Vec<[f64; 3]>, root: &str, body: &str) -> String {
    let library = nappe_client::Client::connect(&server.app.url()).await.expect("a client");
    let triangles = (0..points.len() as u32 / 3).map(|k| [0, 1, 2].map(|c| 3 * k + c)).collect();
    let mesh = MeshUpload { points, triangles, ..MeshUpload::default() };
    let id = library.upload_mesh(&mesh).await.expect("it is a mesh").mesh_id;
    format!(
        "version = 1\ndt = 0.005\n{root}\n[[body]]\nname = \"heap\"\nmesh = {{ upload = \"{id}\" }}\n\
         mass = {{ particle = 0.001 }}\nsprings = {{ stretch = {{ stiffness = 1, damping = 0.001 }} }}\n{body}\n"
    )
}

fn create(text: String) -> v1::CreateSessionRequest {
    v1::CreateSessionRequest { scene: Some(Scene::SceneText(text)), ..request() }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_create_that_looks_for_crossings_ends_with_its_caller() {
    let mut server = Server::with(Limits { max_sessions: 1, ..Limits::default() }).await;
    let long = scene(&server, sheaf(MANY), "", "thickness = 1e-9").await;
    let mut leaver = server.client.clone();
    // Dropping the call tells the server that nobody waits for it.
    let left = timeout(3 * PATIENCE, leaver.create_session(create(long))).await;
    assert!(left.is_err(), "it takes minutes: {left:?}");
    let made = async {
        while let Err(status) = server.client.create_session(create(sheet(3))).await {
            assert_reason(&status, Reason::TooManySessions);
            sleep(Duration::from_millis(5)).await;
        }
    };
    in_time(made).await;
    // It waits for all threads, also for those whose place is free.
    in_time(server.app.shutdown()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_create_that_takes_longer_than_is_allowed_is_refused() {
    let mut server = Server::with(Limits { max_build_seconds: 1, ..Limits::default() }).await;
    let long = scene(&server, sheaf(MANY), "", "thickness = 1e-9").await;
    let refused = server.client.create_session(create(long)).await.expect_err("it takes minutes");
    let told = assert_reason(&refused, Reason::BuildTooLong);
    assert_eq!(told["allowed_seconds"], "1");
    in_time(server.app.shutdown()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_that_counts_crossings_is_stopped_and_deleted_within_a_step() {
    let mut server = Server::start().await;
    let text = scene(&server, sheaf(MORE), "[contact]\nsurface = \"count\"", "").await;
    let [stopped, deleted] = [server.session(text.clone()).await, server.session(text).await];
    for id in [&stopped, &deleted] {
        server.mark_first_step(id).await;
        server.play(id).await;
        server.until_marked_step(id).await;
    }
    // By then they count.
    sleep(3 * PATIENCE).await;

    let stop = server.client.stop_session(v1::StopSessionRequest::of(&stopped));
    let session = in_time(stop).await.expect("stopped").into_inner().session.expect("a session");
    assert_eq!((session.state(), session.step), (SessionState::Finished, 0));
    let delete = server.client.delete_session(v1::DeleteSessionRequest::of(&deleted));
    in_time(delete).await.expect("its thread has ended");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_state_that_is_looked_at_is_given_up_with_its_caller_and_its_session() {
    let mut server = Server::start().await;
    let apart = points(MANY, |k| [3.0 * (k % 150) as f64, 0.0, 3.0 * (k / 150) as f64]);
    let text = scene(&server, apart, "", "thickness = 1e-9").await;
    let id = server.session(text).await;
    let positions_f64: Vec<u8> = sheaf(MANY).as_flattened().iter().flat_map(|c| c.to_le_bytes()).collect();
    let state = v1::StateUpdate {
        body: "heap".into(),
        positions_f64: positions_f64.into(),
        ..v1::StateUpdate::default()
    };
    let put = v1::UpdateParametersRequest { states: vec![state], ..v1::UpdateParametersRequest::of(&id) };

    let mut other = server.client.clone();
    let left = timeout(PATIENCE, other.update_parameters(put.clone())).await;
    assert!(left.is_err(), "it takes minutes: {left:?}");
    // The thread is free again.
    assert_eq!(in_time(server.step(&id, 1)).await.step, 1);

    let waiting = tokio::spawn(async move { other.update_parameters(put).await });
    sleep(PATIENCE).await;
    let delete = server.client.delete_session(v1::DeleteSessionRequest::of(&id));
    in_time(delete).await.expect("its thread has ended");
    in_time(waiting).await.expect("no panic").expect_err("the session is gone");
}
