//! Uploads in calls of one message each, and uploads of files.

use std::time::Duration;

use bytes::Bytes;
use nappe_client::{Client, ClientError, MeshFile, MeshUpload};
use nappe_proto::v1::{self, FileFormat, FileHeader, begin_upload_request::Header};
use nappe_scene::mesh::{write_eti, write_obj, write_off, write_ply};
use nappe_server::{Config, Limits, Reason};
use nappe_sim::mesh::TriangleMesh;
use tonic::Status;

use crate::{
    frames::in_time,
    harness::{Server, assert_reason, config},
};

/// A scene of an uploaded mesh.
fn scene(mesh_id: &str) -> String {
    format!(
        "version = 1\ndt = 0.001\n[[body]]\nname = \"b\"\nmesh = {{ upload = \"{mesh_id}\" }}\n\
         mass = {{ particle = 0.1 }}\nsprings = {{ stretch = {{ stiffness = 10 }} }}\n"
    )
}

fn obj() -> (FileHeader, Bytes) {
    let mut bytes = Vec::new();
    write_obj(&TriangleMesh::grid(20, 30, 0.1), &mut bytes).expect("memory takes it");
    let header = FileHeader {
        name: "sheet.obj".into(),
        format: FileFormat::Obj.into(),
        byte_count: bytes.len() as u64,
        ..FileHeader::default()
    };
    (header, bytes.into())
}

/// The triangles of a mesh as facets.
fn stl(mesh: &TriangleMesh) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for corners in &mesh.triangles {
        bytes.extend([0; 12]);
        let points = corners.iter().flat_map(|i| mesh.points[*i as usize]);
        bytes.extend(points.flat_map(|x| (x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

async fn begin(server: &mut Server, header: Header) -> Result<v1::BeginUploadResponse, Status> {
    let request = v1::BeginUploadRequest { header: Some(header) };
    server.client.begin_upload(request).await.map(tonic::Response::into_inner)
}

async fn append(server: &mut Server, id: &str, offset: usize, data: Bytes) -> Result<u64, Status> {
    let request = v1::AppendUploadRequest { upload_id: id.into(), offset: offset as u64, data };
    server.client.append_upload(request).await.map(|answer| answer.into_inner().received)
}

async fn finish(server: &mut Server, id: &str) -> Result<v1::FinishUploadResponse, Status> {
    let request = v1::FinishUploadRequest { upload_id: id.into() };
    server.client.finish_upload(request).await.map(tonic::Response::into_inner)
}

#[tokio::test(flavor = "multi_thread")]
async fn repeated_and_overlapping_pieces_are_harmless() {
    let mut server = Server::start().await;
    let (header, data) = obj();
    let begun = begin(&mut server, Header::File(header)).await.expect("begun");
    assert_eq!(begun.byte_count as usize, data.len());
    let id = begun.upload_id;

    // Each piece overlaps the one before, and every third is sent twice.
    let mut received = 0;
    for (i, start) in (0..data.len()).step_by(700).enumerate() {
        let from = start.saturating_sub(300);
        let piece = data.slice(from..(start + 700).min(data.len()));
        for _ in 0..=usize::from(i % 3 == 0) {
            received = append(&mut server, &id, from, piece.clone()).await.expect("added");
            assert_eq!(received as usize, (start + 700).min(data.len()));
        }
    }
    assert_eq!(received as usize, data.len());
    assert_eq!(append(&mut server, &id, 0, data.slice(..10)).await.expect("harmless"), received);

    let stored = finish(&mut server, &id).await.expect("a mesh");
    assert_eq!(finish(&mut server, &id).await.expect("the same answer"), stored);
    let session = server.session(scene(&stored.mesh_id)).await;
    assert_eq!(server.step(&session, 2).await.particle_count, 600);
    let late = append(&mut server, &id, 0, data.slice(..10)).await.expect_err("it is finished");
    assert_reason(&late, Reason::InvalidUpload);
}

#[tokio::test(flavor = "multi_thread")]
async fn gaps_excess_and_unknown_uploads_are_refused_and_the_upload_goes_on() {
    let mut server = Server::start().await;
    let (header, data) = obj();
    let id = begin(&mut server, Header::File(header)).await.expect("begun").upload_id;
    append(&mut server, &id, 0, data.slice(..100)).await.expect("added");

    let gap = append(&mut server, &id, 200, data.slice(200..300)).await.expect_err("a gap");
    assert_eq!(assert_reason(&gap, Reason::InvalidUpload)["received"], "100");
    let excess = [data.clone(), Bytes::from_static(b"\n")].concat();
    for (offset, piece) in [(0, excess.into()), (50, Bytes::new()), (0, vec![0; (1 << 20) + 1].into())] {
        let refused = append(&mut server, &id, offset, piece).await.expect_err("refused");
        assert_reason(&refused, Reason::InvalidUpload);
    }
    assert_reason(&finish(&mut server, &id).await.expect_err("not whole"), Reason::InvalidUpload);
    append(&mut server, &id, 100, data.slice(100..)).await.expect("the rest");
    finish(&mut server, &id).await.expect("it is whole");

    let unknown = append(&mut server, "upload-0", 0, data.slice(..1)).await.expect_err("unknown");
    assert_reason(&unknown, Reason::UploadNotFound);
    assert_reason(&finish(&mut server, "upload-0").await.expect_err("unknown"), Reason::UploadNotFound);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_upload_that_nobody_goes_on_with_is_forgotten_with_its_place() {
    let limits = Limits { max_uploads: 1, ..Limits::default() };
    let mut server = Server::with(limits.clone()).await;
    let (header, data) = obj();
    let id = begin(&mut server, Header::File(header.clone())).await.expect("begun").upload_id;
    append(&mut server, &id, 0, data.slice(..100)).await.expect("added");
    let full = begin(&mut server, Header::File(header.clone())).await.expect_err("one at a time");
    assert_reason(&full, Reason::TooManyUploads);

    let mut server = Server::configured(Config { upload_idle_seconds: 0.5, limits, ..config() }).await;
    let id = begin(&mut server, Header::File(header.clone())).await.expect("begun").upload_id;

    // Until its place is free again. On a busy machine another upload may be forgotten too, and is begun again.
    let again = async {
        while whole(&mut server, &header, &data).await.is_err() {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    in_time(again).await;
    assert_reason(&finish(&mut server, &id).await.expect_err("forgotten"), Reason::UploadNotFound);
}

/// Uploads a file in one piece.
async fn whole(server: &mut Server, header: &FileHeader, data: &Bytes) -> Result<(), Status> {
    let id = begin(server, Header::File(header.clone())).await?.upload_id;
    append(server, &id, 0, data.clone()).await?;
    finish(server, &id).await.map(|_| ())
}

#[tokio::test(flavor = "multi_thread")]
async fn files_of_every_format_are_read_by_the_server() {
    let mut server = Server::start().await;
    let client = Client::connect(&server.app.url()).await.expect("it answers");
    let mesh = TriangleMesh { masses: vec![0.1; 12], ..TriangleMesh::grid(4, 3, 0.5) };
    let [mut obj, mut off, mut ply] = [const { Vec::new() }; 3];
    write_obj(&mesh, &mut obj).expect("memory takes it");
    write_off(&mesh, &mut off).expect("memory takes it");
    write_ply(&mesh, &mut ply).expect("memory takes it");
    let set = write_eti(&mesh);
    let text = |text: Option<String>| Bytes::from(text.unwrap_or_default());
    let eti = [text(Some(set.faceset)), text(set.masses), text(set.texcoord)];

    let none: [Bytes; 3] = Default::default();
    let files = [
        (FileFormat::Obj, obj.into(), none.clone()),
        (FileFormat::Off, off.into(), none.clone()),
        (FileFormat::Ply, ply.into(), none.clone()),
        (FileFormat::Stl, stl(&mesh).into(), none),
        (FileFormat::Eti, Bytes::from(set.points), eti),
    ];
    for (format, file, others) in files {
        let file = MeshFile { name: "sheet".into(), format, file, others, missing_mass: None };
        let uploaded = client.upload_file(&file).await.expect("it is read");
        let session = server.session(scene(&uploaded.mesh_id)).await;
        assert_eq!(server.get(&session).await.particle_count, 12, "{format:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_fault_of_a_file_names_its_line() {
    let server = Server::start().await;
    let client = Client::connect(&server.app.url()).await.expect("it answers");
    let broken = |format, text: &'static str| MeshFile {
        name: "cow".into(),
        format,
        file: Bytes::from_static(text.as_bytes()),
        others: Default::default(),
        missing_mass: None,
    };
    let cases = [
        (FileFormat::Obj, "v 0 0 0\nv 1 0\n", Reason::InvalidMesh, Some("2")),
        (FileFormat::Obj, "v 0 0 0\nvt 0 nan\n", Reason::InvalidMesh, Some("2")),
        (FileFormat::Off, "OFF\n1 0 0\n0 0 inf\n", Reason::InvalidMesh, Some("3")),
        (FileFormat::Eti, "2\n0 0 0\n", Reason::InvalidMesh, Some("1")),
        (FileFormat::Unspecified, "v 0 0 0\n", Reason::InvalidField, None),
        // Four thousand million points, of which none follows.
        (
            FileFormat::Ply,
            "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n\
             property float z\nend_header\n",
            Reason::InvalidMesh,
            Some("3"),
        ),
        (FileFormat::Stl, "solid\nfacet\nouter\nvertex 0 0\n", Reason::InvalidMesh, Some("4")),
    ];
    for (format, text, reason, line) in cases {
        let refused = client.upload_file(&broken(format, text)).await.expect_err("refused");
        let ClientError::Server(error) = refused else { panic!("{text}: {refused}") };
        assert_eq!(error.reason.as_deref(), Some(reason.name()), "{text}: {error:?}");
        assert_eq!(error.metadata.get("line").map(String::as_str), line, "{text}: {error:?}");
        assert_eq!(error.metadata.contains_key("violation"), line.is_some(), "{text}: {error:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_file_is_refused_before_it_is_read_where_that_would_take_too_much_memory_or_gzip_has_packed_it() {
    let limits = Limits { max_request_bytes: 1 << 20, ..Limits::default() };
    let server = Server::with(limits).await;
    let client = Client::connect(&server.app.url()).await.expect("it answers");
    let file = |file: Vec<u8>| MeshFile {
        name: "cow.obj".into(),
        format: FileFormat::Obj,
        file: file.into(),
        others: Default::default(),
        missing_mass: None,
    };
    // One polygon of 50 000 corners: 100 kB of text, 600 kB of triangles, and its words while they are read.
    let large = format!("v 0 0 0\nf {}\n", "1 ".repeat(50_000));
    for (bytes, reason) in [
        (large.into_bytes(), Reason::RequestMemoryFull),
        (vec![0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 3], Reason::InvalidMesh),
    ] {
        let refused = client.upload_file(&file(bytes)).await.expect_err("refused");
        let ClientError::Server(error) = refused else { panic!("{refused}") };
        assert_eq!(error.reason.as_deref(), Some(reason.name()), "{error:?}");
        assert_eq!(error.message.contains("gzip"), reason == Reason::InvalidMesh, "{error:?}");
        let never_fits = error.message.contains("--max-request-bytes raises the limit");
        assert_eq!(never_fits, reason == Reason::RequestMemoryFull, "{error:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_stl_of_half_a_million_facets_is_read_within_the_limits_of_a_server() {
    let server = Server::start().await;
    let client = Client::connect(&server.app.url()).await.expect("it answers");
    let mesh = TriangleMesh::grid(500, 500, 0.01);
    let file = Bytes::from(stl(&mesh));
    assert!(file.len() > 24_000_000, "{}", file.len());
    let (name, others) = ("sheet.stl".into(), Default::default());
    let file = MeshFile { name, format: FileFormat::Stl, file, others, missing_mass: None };
    let uploaded = client.upload_file(&file).await.expect("it is read");
    assert!(uploaded.warnings.is_empty(), "corners in one place are one point: {:?}", uploaded.warnings);
}

#[tokio::test(flavor = "multi_thread")]
async fn texture_coordinates_that_are_not_finite_are_refused() {
    let server = Server::start().await;
    let client = Client::connect(&server.app.url()).await.expect("it answers");
    for bad in [f32::NAN, f32::INFINITY] {
        let mesh = MeshUpload {
            points: vec![[0.0; 3]; 2],
            uv: vec![[0.0, 0.0], [0.5, bad]],
            ..MeshUpload::default()
        };
        let refused = client.upload_mesh(&mesh).await.expect_err("refused");
        let ClientError::Server(error) = refused else { panic!("{refused}") };
        assert_eq!(error.reason.as_deref(), Some(Reason::InvalidMesh.name()));
        assert!(error.message.contains("texture coordinates of point 1"), "{error:?}");
    }
}

/// A PC2 file of two frames of four points of a level square, which goes down.
fn pc2() -> Vec<u8> {
    let mut bytes = b"POINTCACHE2\0".to_vec();
    bytes.extend([1_i32, 4].map(i32::to_le_bytes).as_flattened());
    bytes.extend([0.0_f32, 1.0].map(f32::to_le_bytes).as_flattened());
    bytes.extend(2_i32.to_le_bytes());
    for height in [-1.0, -1.5] {
        let points = TriangleMesh::grid(2, 2, 0.5).points.into_iter().map(|[x, _, z]| [x, height, z]);
        bytes.extend(points.flatten().flat_map(|c| (c as f32).to_le_bytes()));
    }
    bytes
}

#[tokio::test(flavor = "multi_thread")]
async fn uploaded_frames_lead_a_figure_and_those_that_were_cut_are_refused() {
    let mut server = Server::start().await;
    let client = Client::connect(&server.app.url()).await.expect("it answers");
    let frames = |file: Vec<u8>| MeshFile {
        name: "walk.pc2".into(),
        format: FileFormat::Pc2,
        file: file.into(),
        others: Default::default(),
        missing_mass: None,
    };
    let mut cut = pc2();
    cut.pop();
    let refused = client.upload_file(&frames(cut)).await.expect_err("refused");
    let ClientError::Server(error) = refused else { panic!("{refused}") };
    assert_eq!(error.reason.as_deref(), Some(Reason::InvalidMesh.name()), "{error:?}");
    assert!(error.message.contains("walk.pc2") && error.message.contains("was cut"), "{error:?}");

    let frames_id = client.upload_file(&frames(pc2())).await.expect("it is read").mesh_id;
    let (name, mesh) = ("square".to_owned(), TriangleMesh::grid(2, 2, 0.5));
    let mesh = MeshUpload { name, points: mesh.points, triangles: mesh.triangles, ..MeshUpload::default() };
    let mesh_id = client.upload_mesh(&mesh).await.expect("it is kept").mesh_id;
    let text = |mesh: &str, frames: &str| {
        format!(
            "version = 1\ndt = 0.001\n[[body]]\nname = \"b\"\nmesh = {{ grid = [3, 3], spacing = 0.1 }}\n\
             mass = {{ particle = 0.1 }}\nthickness = 0.01\n[[figure]]\nname = \"f\"\nmesh = {{ upload = \"{mesh}\" }}\n\
             thickness = 0.01\nframes = {{ upload = \"{frames}\", rate = 25 }}\n"
        )
    };
    let session = server.session(text(&mesh_id, &frames_id)).await;
    assert_eq!(server.get(&session).await.particle_count, 13);
}
