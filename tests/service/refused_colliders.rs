//! Meshes of colliders that a server refuses: by what it has room for, by how many triangles a scene may have, by what
//! they are.

use nappe_client::MeshUpload;
use nappe_proto::v1::{self, create_session_request::Scene};
use nappe_server::{Limits, Reason};
use tonic::Status;

use crate::{
    cloth_scenes::dust,
    harness::{Server, assert_reason, request},
};

/// So many triangles on the same three points.
async fn upload(server: &Server, count: usize) -> String {
    let library = nappe_client::Client::connect(&server.app.url()).await.expect("a client");
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mesh = MeshUpload { points, triangles: vec![[0, 1, 2]; count], ..MeshUpload::default() };
    library.upload_mesh(&mesh).await.expect("it is a mesh").mesh_id
}

/// Asks for a session with a collider of an uploaded mesh.
async fn refused(server: &mut Server, id: &str) -> Status {
    let collider = format!("\n[[collider]]\nname = \"c\"\nmesh = {{ upload = \"{id}\" }}\n");
    let text = Scene::SceneText(dust(4, "") + &collider);
    let asked = v1::CreateSessionRequest { scene: Some(text), ..request() };
    server.client.create_session(asked).await.expect_err("the collider is none")
}

#[tokio::test(flavor = "multi_thread")]
async fn the_bytes_of_a_collider_count_before_it_is_made() {
    let limits =
        Limits { max_server_bytes: 16 << 20, history_bytes_per_session: 1 << 20, ..Limits::default() };
    let mut server = Server::with(limits).await;
    let id = upload(&server, 100_000).await;
    let told = assert_reason(&refused(&mut server, &id).await, Reason::ServerMemoryFull);
    let needed: u64 = told["needed_bytes"].parse().expect("a number");
    assert!(needed > 100_000 * 200, "{told:?}");
    // Without the collider there is room.
    let made = server.session(dust(4, "")).await;
    server.step(&made, 1).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_collider_that_is_none_is_refused_with_its_key() {
    let mut server = Server::start().await;
    let [open, many] = [upload(&server, 1).await, upload(&server, 200_001).await];
    for (id, reason, violation, part) in [
        (
            open.as_str(),
            Reason::InvalidScene,
            "BAD_MESH",
            "is not closed: the edge from point 0 at (0, 0, 0)",
        ),
        (
            many.as_str(),
            Reason::SceneTooLarge,
            "TOO_LARGE",
            "this collider has 200001 triangles; allowed: at most 200000",
        ),
        ("mesh-none", Reason::MeshNotFound, "MESH_NOT_FOUND", "no mesh with the id 'mesh-none' was uploaded"),
    ] {
        let status = refused(&mut server, id).await;
        let told = assert_reason(&status, reason);
        assert_eq!(told["violation"], violation);
        assert!(told["field"].starts_with("collider[0].mesh"), "{told:?}");
        assert!(status.message().contains(part), "{}", status.message());
    }
}
