//! UploadMesh: what is accepted, what is refused, and when.

use std::time::Duration;

use bytes::Bytes;
use nappe_proto::v1::{
    self, MeshHeader, UploadMeshRequest, create_session_request::Scene, upload_mesh_request::Part,
};
use nappe_server::{Config, Limits, Reason};
use tonic::Status;

use crate::harness::{Server, assert_reason, every, request};

/// A triangle with masses; the first point is pinned.
fn triangle() -> (MeshHeader, Vec<u8>) {
    let mut data = Vec::new();
    let points = [[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 1.0]];
    data.extend(points.as_flattened().iter().flat_map(|c: &f64| c.to_le_bytes()));
    data.extend([0_u32, 1, 2].iter().flat_map(|i| i.to_le_bytes()));
    data.extend([0.0_f64, 0.5, 0.5].iter().flat_map(|m| m.to_le_bytes()));
    let header =
        MeshHeader { name: "triangle".into(), point_count: 3, triangle_count: 1, mass_count: 3, uv_count: 0 };
    (header, data)
}

fn header(header: MeshHeader) -> UploadMeshRequest {
    UploadMeshRequest { part: Some(Part::Header(header)) }
}

fn piece(bytes: impl Into<Bytes>) -> UploadMeshRequest {
    UploadMeshRequest { part: Some(Part::Data(bytes.into())) }
}

async fn send(server: &mut Server, pieces: Vec<UploadMeshRequest>) -> Result<v1::UploadMeshResponse, Status> {
    server.client.upload_mesh(tokio_stream::iter(pieces)).await.map(tonic::Response::into_inner)
}

#[tokio::test(flavor = "multi_thread")]
async fn an_uploaded_mesh_can_be_simulated() {
    let mut server = Server::start().await;
    let (sizes, data) = triangle();

    // In pieces that do not respect the arrays.
    let mut pieces = vec![header(sizes)];
    pieces.extend(data.chunks(7).map(|chunk| piece(chunk.to_vec())));
    let mesh_id = send(&mut server, pieces).await.expect("accepted").mesh_id;
    let text = format!(
        "version = 1\ndt = 0.001\n[[body]]\nname = \"t\"\nmesh = {{ upload = \"{mesh_id}\" }}\n\
         [body.springs]\nstretch = {{ stiffness = 10 }}\n"
    );
    let id =
        server.create(v1::CreateSessionRequest { scene: Some(Scene::SceneText(text)), ..request() }).await;
    assert_eq!(server.step(&id, 5).await.particle_count, 3);
    let mut watch = server.watch(every(&id, 0)).await;
    let pins = &watch.topology.bodies[0].pins_u32;
    assert_eq!(pins[..], 0_u32.to_le_bytes());
    let first = watch.frame().await.numbers(v1::Field::Positions, f32::from_le_bytes);
    assert_eq!(first, [0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0]);
}

#[tokio::test(flavor = "multi_thread")]
async fn pieces_that_do_not_follow_the_header_are_refused() {
    let mut server = Server::start().await;
    let (sizes, data) = triangle();
    let whole = || piece(data.clone());
    let cases = [
        vec![],
        vec![whole()],
        vec![UploadMeshRequest { part: None }],
        vec![header(sizes.clone()), header(sizes.clone())],
        vec![header(sizes.clone()), piece(data[1..].to_vec())],
        vec![header(sizes.clone()), whole(), piece(vec![0])],
        vec![
            header(MeshHeader { point_count: 100_000, mass_count: 0, ..sizes.clone() }),
            piece(vec![0; (1 << 20) + 1]),
        ],
    ];

    for (i, pieces) in cases.into_iter().enumerate() {
        let status = send(&mut server, pieces).await.expect_err("refused");
        assert_reason(&status, Reason::InvalidUpload);
        println!("case {i}: {}", status.message());
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_mesh_that_cannot_be_simulated_is_refused() {
    let mut server = Server::start().await;
    let (sizes, data) = triangle();
    let broken_at = |offset: usize, bytes: &[u8]| {
        let mut data = data.clone();
        data[offset..offset + bytes.len()].copy_from_slice(bytes);
        vec![header(sizes.clone()), piece(data)]
    };
    for pieces in [
        broken_at(0, &f64::NAN.to_le_bytes()),
        broken_at(72, &9_u32.to_le_bytes()),
        broken_at(84, &(-1.0_f64).to_le_bytes()),
    ] {
        assert_reason(&send(&mut server, pieces).await.expect_err("refused"), Reason::InvalidMesh);
    }

    for sizes in [
        MeshHeader { point_count: 0, mass_count: 0, ..sizes.clone() },
        MeshHeader { mass_count: 2, ..sizes.clone() },
        MeshHeader { uv_count: 1, ..sizes.clone() },
        MeshHeader { name: "x".repeat(300), ..sizes },
    ] {
        let status = send(&mut server, vec![header(sizes)]).await.expect_err("refused");
        assert_reason(&status, Reason::InvalidField);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_upload_that_pauses_is_forgotten_and_its_place_is_free_again() {
    let limits = Limits { max_uploads: 1, ..Limits::default() };
    let config = Config { upload_idle_seconds: 0.5, limits, ..Config::default() };
    let mut server = Server::configured(config).await;
    let (sizes, data) = triangle();
    let (sender, receiver) = tokio::sync::mpsc::channel(4);
    sender.send(header(sizes.clone())).await.expect("room");
    let mut other = server.client.clone();
    let stream = tokio_stream::wrappers::ReceiverStream::new(receiver);
    let orphan = tokio::spawn(async move { other.upload_mesh(stream).await });
    tokio::time::sleep(Duration::from_millis(200)).await;
    let full = send(&mut server, vec![header(sizes.clone()), piece(data.clone())]).await;
    assert_reason(&full.expect_err("one upload at a time"), Reason::TooManyUploads);
    let status = orphan.await.expect("no panic").expect_err("it pauses for too long");
    assert_reason(&status, Reason::UploadTimedOut);
    send(&mut server, vec![header(sizes), piece(data)]).await.expect("the place is free");
    drop(sender);
}
