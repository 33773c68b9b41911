//! UploadMesh: what is accepted, what is refused, and when.

use std::time::Duration;

use bytes::Bytes;
use nappe_proto::v1::{
    self, MeshHeader, UploadMeshRequest, UploadMeshResponse, create_session_request::Scene,
    upload_mesh_request::Part,
};
use nappe_server::{Config, Limits, Reason};
use tokio::{sync::mpsc::Sender, task::JoinHandle};
use tonic::{Response, Status};

use crate::{
    cloth_scenes::sheet,
    frames::in_time,
    harness::{Server, assert_reason, config, every, request},
};

/// A triangle with masses; the first point is pinned.
fn triangle() -> (MeshHeader, Vec<u8>) {
    let mut data = Vec::new();
    let points = [[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 1.0]];
    data.extend(points.as_flattened().iter().flat_map(|c: &f64| c.to_le_bytes()));
    data.extend([0_u32, 1, 2].iter().flat_map(|i| i.to_le_bytes()));
    data.extend([0.0_f64, 0.5, 0.5].iter().flat_map(|m| m.to_le_bytes()));
    let header = MeshHeader {
        name: "triangle".into(),
        point_count: 3,
        triangle_count: 1,
        mass_count: 3,
        ..MeshHeader::default()
    };
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
        vec![header(sizes.clone()), piece(Vec::new()), whole()],
        vec![header(sizes.clone()), whole(), piece(Vec::new())],
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
    let mut server = Server::with(limits.clone()).await;
    let (sizes, data) = triangle();
    let small = || vec![header(sizes.clone()), piece(data.clone())];

    // Who comes first has the only place: until that is the upload that pauses.
    let full = loop {
        let (_sender, orphan) = pausing(&server);
        let refused = async {
            while !orphan.is_finished() {
                if let Err(full) = send(&mut server, small()).await {
                    return Some(full);
                }
            }
            None
        };
        if let Some(full) = in_time(refused).await {
            break full;
        }
    };
    assert_reason(&full, Reason::TooManyUploads);

    let mut server = Server::configured(Config { upload_idle_seconds: 0.5, limits, ..config() }).await;
    let (_sender, orphan) = pausing(&server);
    let status = in_time(orphan).await.expect("no panic").expect_err("it pauses for too long");
    assert_reason(&status, Reason::UploadTimedOut);
    until_accepted(&mut server, &small()).await;
}

/// An upload of which nothing comes after its header, as long as the sender is there.
fn pausing(
    server: &Server,
) -> (Sender<UploadMeshRequest>, JoinHandle<Result<Response<UploadMeshResponse>, Status>>) {
    let (sender, receiver) = tokio::sync::mpsc::channel(4);
    sender.try_send(header(triangle().0)).expect("room");
    let mut client = server.client.clone();
    let stream = tokio_stream::wrappers::ReceiverStream::new(receiver);
    (sender, tokio::spawn(async move { client.upload_mesh(stream).await }))
}

/// Sends pieces until they are accepted: a place must be free again, and a busy machine may take too long once more.
async fn until_accepted(server: &mut Server, pieces: &[UploadMeshRequest]) {
    let again = async {
        while send(server, pieces.to_vec()).await.is_err() {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    in_time(again).await;
}

/// Sends the triangle a byte at a time, for ever if nobody stops it; gives the error of the upload.
async fn trickle(server: &Server, pause: Duration) -> Status {
    let (sizes, _) = triangle();
    let header = header(MeshHeader { point_count: 1000, triangle_count: 0, mass_count: 0, ..sizes });
    let (sender, receiver) = tokio::sync::mpsc::channel(4);
    let mut client = server.client.clone();
    let stream = tokio_stream::wrappers::ReceiverStream::new(receiver);
    let upload = tokio::spawn(async move { client.upload_mesh(stream).await });
    sender.send(header).await.expect("room");
    let sending = async {
        while sender.send(piece(vec![0])).await.is_ok() {
            tokio::time::sleep(pause).await;
        }
    };
    in_time(sending).await;
    in_time(upload).await.expect("no panic").expect_err("it never ends")
}

#[tokio::test(flavor = "multi_thread")]
async fn an_upload_that_never_pauses_ends_at_its_deadline() {
    let limits = Limits { upload_seconds: 1, max_uploads: 1, ..Limits::default() };
    let mut server = Server::with(limits).await;
    let status = trickle(&server, Duration::from_millis(50)).await;
    assert_reason(&status, Reason::UploadTimedOut);
    assert!(status.message().contains("within 1 s"), "{status}");
    let (sizes, data) = triangle();
    until_accepted(&mut server, &[header(sizes), piece(data)]).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_upload_below_the_least_rate_is_given_up_after_its_first_seconds() {
    let mut server = Server::start().await;
    let status = trickle(&server, Duration::from_millis(200)).await;
    let metadata = assert_reason(&status, Reason::UploadTooSlow);
    assert_eq!(metadata["bytes_per_second"], "64000");
    let (sizes, data) = triangle();
    send(&mut server, vec![header(sizes), piece(data)]).await.expect("it goes on");
}

#[tokio::test(flavor = "multi_thread")]
async fn memory_of_requests_in_progress_is_bounded() {
    let limits = Limits { max_request_bytes: 1 << 20, ..Limits::default() };
    let mut server = Server::with(limits.clone()).await;
    let large = MeshHeader { name: "zeros".into(), point_count: 50_000, ..MeshHeader::default() };
    let pieces = |count: u64| {
        let data = (0..count * 24 / 1000).map(|_| piece(vec![0; 1000]));
        let first = header(MeshHeader { point_count: count, ..large.clone() });
        std::iter::once(first).chain(data).collect::<Vec<_>>()
    };
    let refused = send(&mut server, pieces(50_000)).await.expect_err("1.2 MB");
    let metadata = assert_reason(&refused, Reason::RequestMemoryFull);
    assert_eq!(metadata["allowed_bytes"], "1048576");

    // An upload that waits keeps what it has taken, and small requests still find room.
    let header = v1::begin_upload_request::Header::Mesh(MeshHeader { point_count: 35_000, ..large.clone() });
    let waits = v1::BeginUploadRequest { header: Some(header) };
    let begun = server.client.begin_upload(waits.clone()).await;
    let upload_id = begun.expect("begun").into_inner().upload_id;
    let append = v1::AppendUploadRequest { upload_id, offset: 0, data: vec![0; 10_000].into() };
    server.client.append_upload(append).await.expect("added");
    let text = |length| v1::CreateSessionRequest {
        scene: Some(Scene::SceneText(format!("# {}", "x".repeat(length)))),
        ..request()
    };
    let full = server.client.create_session(text(500_000)).await.expect_err("no room");
    assert_reason(&full, Reason::RequestMemoryFull);
    let status = server.client.create_session(text(1000)).await.expect_err("no scene");
    assert_reason(&status, Reason::InvalidScene);

    // Whoever is forgotten gives his memory back.
    let mut server = Server::configured(Config { upload_idle_seconds: 0.5, limits, ..config() }).await;
    server.client.begin_upload(waits).await.expect("begun");
    until_accepted(&mut server, &pieces(35_000)).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn elements_of_a_request_are_counted_before_they_are_decoded() {
    let mut server = Server::start().await;
    let id = server.session(sheet(3)).await;
    let allowed = Limits::default().max_changes_per_call as usize;
    let update = v1::UpdateParametersRequest {
        session_id: id.clone(),
        pins: vec![v1::PinUpdate::default(); allowed + 1],
        ..v1::UpdateParametersRequest::default()
    };
    let status = server.client.update_parameters(update).await.expect_err("too many");
    assert_reason(&status, Reason::TooManyChanges);
    let watch = v1::WatchFramesRequest { session_id: id, fields: vec![1; allowed + 1], ..Default::default() };
    let status = server.client.watch_frames(watch).await.expect_err("too many");
    assert_reason(&status, Reason::InvalidMessage);
}
