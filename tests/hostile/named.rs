//! Short requests that name something large: what the server takes for them at most.

use std::sync::atomic::Ordering;

use bytes::Bytes;
use nappe_proto::v1::{
    self, MeshHeader, UploadMeshRequest, create_session_request::Scene,
    simulation_service_client::SimulationServiceClient, upload_mesh_request::Part,
};
use nappe_server::{App, Limits};
use tonic::{Code, transport::Channel};

use crate::{IGNORED, alone, peak_since, requests::runtime, server};

type Client = SimulationServiceClient<Channel>;

/// Points of the mesh that is named, and particles of the bodies.
const POINTS: u64 = 100_000;
/// Bytes from which an allocation only shows that there is so much.
const SEEN_ONLY: usize = 128 << 20;

/// A server of a GiB, and a client of it.
pub(crate) async fn with_client() -> (App, Client) {
    let limits =
        Limits { max_server_bytes: 1 << 30, history_bytes_per_session: 1 << 20, ..Limits::default() };
    let (app, channel) = server(limits).await;
    (app, SimulationServiceClient::new(channel))
}

/// A scene of `count` particles without springs, and more keys of the body.
fn dust(count: u64, more: &str) -> v1::CreateSessionRequest {
    let text = format!(
        "version = 1\ndt = 1e-3\n[[body]]\nname = \"dust\"\nmesh = {{ grid = [1, {count}], spacing = 0.01 }}\n\
         mass = {{ particle = 0.1 }}\nintegrator = \"symplectic_euler\"\n{more}"
    );
    let scene = Some(Scene::SceneText(text));
    v1::CreateSessionRequest { scene, thread_count: 1, ..v1::CreateSessionRequest::default() }
}

/// Makes a session of `count` particles, with more keys of their body, and gives its id.
pub(crate) async fn session(client: &mut Client, count: u64, more: &str) -> String {
    let made = client.create_session(dust(count, more)).await.expect("a session is made").into_inner();
    made.session.expect("the answer has the session").session_id
}

/// Uploads points and velocities, and gives the id of the mesh.
async fn upload(client: &mut Client) -> String {
    let header = MeshHeader { point_count: POINTS, velocity_count: POINTS, ..MeshHeader::default() };
    let (total, zeros) = (48 * POINTS, Bytes::from(vec![0; 1 << 20]));
    let pieces = (0..total.div_ceil(1 << 20)).map(move |i| {
        let length = (total - (i << 20)).min(1 << 20) as usize;
        Part::Data(zeros.slice(..length))
    });
    let parts = std::iter::once(Part::Header(header)).chain(pieces);
    let requests = parts.map(|part| UploadMeshRequest { part: Some(part) });
    let uploaded = client.upload_mesh(tokio_stream::iter(requests)).await;
    uploaded.expect("a mesh of zeros is a mesh").into_inner().mesh_id
}

#[test]
fn states_by_the_id_of_an_upload_copy_nothing_that_waits_or_is_refused() {
    let _alone = alone();
    runtime().block_on(async {
        let (app, mut client) = with_client().await;
        let (all, few) = (session(&mut client, POINTS, "").await, session(&mut client, 10, "").await);
        let mesh = upload(&mut client).await;
        let states = |id: &str, count: usize| {
            let state = v1::StateUpdate {
                body: "dust".into(),
                upload_id: mesh.clone(),
                ..v1::StateUpdate::default()
            };
            v1::UpdateParametersRequest {
                at_step: 100,
                states: vec![state; count],
                ..v1::UpdateParametersRequest::of(id)
            }
        };
        let cases = [
            (states(&all, 100), Some("states 0 and 1 put 'dust'")),
            (states(&few, 100), Some("states 0 and 1 put 'dust'")),
            (states(&few, 1), Some("positions of 100000 particles, and the body has 10")),
            (states(&all, 1), None),
        ];
        for (request, refusal) in cases {
            let count = request.states.len();
            let mut answer = None;
            let peak = peak_since(async { answer = Some(client.update_parameters(request).await) }).await;
            println!("{count} states took {peak} bytes at most");
            assert!(
                peak < 24 * POINTS as usize,
                "{count} states: {peak} bytes, more than a copy of the points"
            );
            match (answer.expect("the call was answered"), refusal) {
                (Ok(_), None) => {}
                (Err(status), Some(told)) => {
                    assert_eq!(status.code(), Code::InvalidArgument, "{status}");
                    assert!(status.message().contains(told), "{}, not {told}", status.message());
                }
                (answer, refusal) => panic!("{answer:?}, not {refusal:?}"),
            }
        }
        app.shutdown().await;
    });
}

#[test]
fn a_name_of_many_particles_in_a_scene_counts_as_many_or_once() {
    let _alone = alone();
    // What the server asks for only to see whether it is there is larger than all that these scenes take.
    IGNORED.store(SEEN_ONLY, Ordering::Relaxed);
    runtime().block_on(async {
        let (app, mut client) = with_client().await;
        let forces = "[[body.force]]\non = \"all\"\nforce = [0, 1, 0]\n".repeat(10_000);
        let moving = "[[body.moving_pin]]\npin = \"left\"\noffset = [0, 1, 0]\nduration = 1\n".repeat(10_000);
        // Of a grid of one column, the left side has all particles: lists of 4 GB, 100 GB and 400 MB.
        let cases = [
            (forces, Code::ResourceExhausted),
            (format!("pins = [\"left\"]\n{moving}"), Code::ResourceExhausted),
            (format!("pins = [{}]\n", "\"left\", ".repeat(1000)), Code::Ok),
        ];
        for (more, expected) in cases {
            let length = more.len();
            let mut code = Code::Ok;
            let peak = peak_since(async {
                let made = client.create_session(dust(POINTS, &more)).await;
                code = made.map_or_else(|status| status.code(), |_| Code::Ok);
            });
            let peak = peak.await;
            println!("{length} bytes of a scene took {peak} bytes at most, {code:?}");
            assert_eq!(code, expected);
            assert!(peak < SEEN_ONLY, "{peak} bytes for {length}");
        }
        app.shutdown().await;
    });
    IGNORED.store(usize::MAX, Ordering::Relaxed);
}
